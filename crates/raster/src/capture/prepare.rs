//! A soup in an order that keeps neighbours together, with the means that small triangles show.

use crate::surface::Surfaces;
use forest_soup::TriangleSoup;
use glam::{DVec3, Vec2, Vec3};
use rayon::prelude::*;
use std::ops::Range;

/// A triangle as captures draw it.
#[derive(Clone, Debug)]
pub(super) struct Prepared {
    /// Its number in the soup.
    pub(super) id: u32,
    pub(super) material: u16,
    pub(super) translucent: bool,
    /// Area in square world units.
    pub(super) area: f32,
    /// Area in texels of its texture.
    pub(super) texels: f32,
    /// Mean of what it shows: linear RGB, not premultiplied.
    pub(super) rgb: [f32; 3],
    /// Its own unit normal.
    pub(super) own: Vec3,
    /// Mean of its vertex normals.
    pub(super) normal: Vec3,
}

/// Halvings when a texture is averaged over a triangle: 64 samples.
const MEAN_DEPTH: u32 = 6;

/// A few triangles that lie together, with vertices of their own.
#[derive(Clone, Debug)]
pub(super) struct Cluster {
    pub(super) triangles: Range<u32>,
    pub(super) vertices: Range<u32>,
    /// A sphere around them, about the middle of the scene.
    pub(super) center: Vec3,
    pub(super) radius: f32,
}

/// Triangles of a cluster.
const CLUSTER: usize = 32;

/// A soup in the order that captures want.
pub(super) struct Sorted {
    pub(super) triangles: Vec<Prepared>,
    /// Numbers of their vertices in `sources`.
    pub(super) corners: Vec<[u32; 3]>,
    pub(super) clusters: Vec<Cluster>,
    /// The soup's vertices, cluster by cluster.
    pub(super) sources: Vec<u32>,
}

/// Sorts triangles along a space-filling curve in the box about `middle`.
pub(super) fn prepare(soup: &TriangleSoup, surfaces: &Surfaces, middle: DVec3) -> Sorted {
    let extent = soup.bounds().size().max_element().max(f64::MIN_POSITIVE);
    let mut order: Vec<(u32, u32)> = (0..soup.triangles.len() as u32)
        .into_par_iter()
        .filter(|&i| soup.corners(i as usize).iter().all(|p| p.is_finite()))
        .filter(|&i| surfaces.get(soup.triangle_materials[i as usize]).is_some())
        .map(|i| {
            let [a, b, c] = soup.corners(i as usize).map(Vec3::as_dvec3);
            let at = ((a + b + c) / 3.0 - middle) / extent + 0.5;
            (morton((at * 1023.0).to_array().map(|v| v as u32)), i)
        })
        .collect();
    order.par_sort_unstable();
    let triangles: Vec<Prepared> =
        order.into_par_iter().map(|(_, i)| shaded(soup, surfaces, i)).collect();
    let mut out = Sorted {
        corners: Vec::with_capacity(triangles.len()),
        clusters: Vec::with_capacity(triangles.len().div_ceil(CLUSTER)),
        sources: Vec::new(),
        triangles,
    };
    // The number of a vertex in the cluster that saw it last.
    let mut seen = vec![(u32::MAX, 0); soup.positions.len()];
    for (number, cluster) in (0..).zip(out.triangles.chunks(CLUSTER)) {
        let first = out.sources.len();
        for t in cluster {
            out.corners.push(soup.triangles[t.id as usize].map(|v| {
                let entry = &mut seen[v as usize];
                if entry.0 != number {
                    *entry = (number, out.sources.len() as u32);
                    out.sources.push(v);
                }
                entry.1
            }));
        }
        let at = |v: &u32| (soup.positions[*v as usize].as_dvec3() - middle).as_vec3();
        let used = || out.sources[first..].iter().map(at);
        let min = used().fold(Vec3::INFINITY, Vec3::min);
        let max = used().fold(Vec3::NEG_INFINITY, Vec3::max);
        let center = (min + max) * 0.5;
        let end = out.corners.len() as u32;
        out.clusters.push(Cluster {
            triangles: end - cluster.len() as u32..end,
            vertices: first as u32..out.sources.len() as u32,
            center,
            radius: used().map(|p| p.distance(center)).fold(0.0, f32::max),
        });
    }
    out
}

fn shaded(soup: &TriangleSoup, surfaces: &Surfaces, id: u32) -> Prepared {
    let i = id as usize;
    let material = soup.triangle_materials[i];
    let surface = surfaces.get(material).expect("filtered above");
    let vertices = soup.triangles[i];
    let [a, b, c] = soup.corners(i);
    let cross = (b - a).cross(c - a);
    let own = cross.normalize_or_zero();
    let normals = vertices.map(|v| soup.normals.get(v as usize).copied().unwrap_or(Vec3::ZERO));
    let normal = normals.map(|n| if n == Vec3::ZERO { own } else { n }).iter().sum::<Vec3>();
    let uvs = vertices.map(|v| soup.uvs.get(v as usize).copied().unwrap_or(Vec2::ZERO));
    let tints = vertices.map(|v| soup.colors.get(v as usize).copied().unwrap_or([1.0; 4]));
    let tint = std::array::from_fn(|k| (tints[0][k] + tints[1][k] + tints[2][k]) / 3.0);
    Prepared {
        id,
        material,
        translucent: surface.translucent,
        area: 0.5 * cross.length(),
        texels: 0.5 * (uvs[1] - uvs[0]).perp_dot(uvs[2] - uvs[0]).abs() * surface.texels(),
        rgb: surface.mean(uvs, tint, MEAN_DEPTH),
        own,
        normal: normal.normalize_or_zero(),
    }
}

/// Bits of three numbers below 1024, in turns.
fn morton(v: [u32; 3]) -> u32 {
    let spread = |v: u32| {
        let v = (v | v << 16) & 0x0300_00ff;
        let v = (v | v << 8) & 0x0300_f00f;
        let v = (v | v << 4) & 0x030c_30c3;
        (v | v << 2) & 0x0924_9249
    };
    spread(v[0]) | spread(v[1]) << 1 | spread(v[2]) << 2
}
