//! Triangles of the soup become triangle records.

use crate::bake::frame::BlockFrame;
use crate::bake::lattice::Quantiser;
use crate::record::encode_axis;
use crate::size::SizeCode;
use crate::triangle::{TriangleRecord, UvRange, VertexRecord};
use forest_soup::{Material, Texture, TriangleSoup, Wrap, linear_to_srgb8};
use glam::{DVec3, Vec2};
use rayon::prelude::*;
use std::sync::Arc;

/// Vertex colours of a triangle: sRGB and alpha, 8 bits each.
pub(crate) type TriangleColors = [[u8; 4]; 3];

/// How textures are laid on, by material.
pub(crate) struct Laid {
    wraps: Vec<[Wrap; 2]>,
}

/// Least and greatest texture coordinates, by material.
pub(crate) struct UvBounds(Vec<(Vec2, Vec2)>);

impl Laid {
    pub(crate) fn new(materials: &[Material], textures: &[Arc<Texture>]) -> Self {
        let wrap = |m: &Material| m.texture.map_or([Wrap::Clamp; 2], |t| textures[t as usize].wrap);
        Self { wraps: materials.iter().map(wrap).collect() }
    }

    /// The bounds of no triangle.
    pub(crate) fn empty(&self) -> UvBounds {
        UvBounds(vec![(Vec2::INFINITY, Vec2::NEG_INFINITY); self.wraps.len()])
    }

    /// The bounds of all triangles.
    pub(crate) fn uv_bounds(&self, soup: &TriangleSoup) -> UvBounds {
        (0..soup.triangles.len())
            .into_par_iter()
            .with_min_len(1 << 14)
            .fold(
                || self.empty(),
                |mut bounds, i| {
                    let m = soup.triangle_materials[i] as usize;
                    let b = &mut bounds.0[m];
                    for uv in near_zero(soup, i, self.wraps[m]) {
                        *b = (b.0.min(uv), b.1.max(uv));
                    }
                    bounds
                },
            )
            .reduce(|| self.empty(), UvBounds::union)
    }
}

impl UvBounds {
    pub(crate) fn union(self, o: Self) -> Self {
        Self(self.0.iter().zip(&o.0).map(|(a, b)| (a.0.min(b.0), a.1.max(b.1))).collect())
    }
}

/// Makes triangle records.
pub(crate) struct TriangleEncoder {
    frame: BlockFrame,
    laid: Laid,
    /// Whether triangles have colours.
    pub(crate) colors: bool,
    pub(crate) uv_ranges: Vec<UvRange>,
}

impl TriangleEncoder {
    pub(crate) fn new(frame: BlockFrame, laid: Laid, bounds: UvBounds, colors: bool) -> Self {
        let uv_ranges = bounds.0.into_iter().map(|(min, max)| range(min, max)).collect();
        Self { frame, laid, colors, uv_ranges }
    }

    /// Triangle `i` of `soup`.
    pub(crate) fn encode(
        &self,
        soup: &TriangleSoup,
        i: usize,
        size: SizeCode,
        quantiser: &Quantiser,
    ) -> TriangleRecord {
        let material = soup.triangle_materials[i];
        let range = self.uv_ranges[material as usize];
        let uvs = near_zero(soup, i, self.laid.wraps[material as usize]);
        let points = soup.corners(i).map(|p| self.frame.map(p));
        let face = (points[1] - points[0]).cross(points[2] - points[0]).normalize_or(DVec3::Y);
        let corners = std::array::from_fn(|k| {
            let vertex = soup.triangles[i][k] as usize;
            let normal = soup.normals.get(vertex).map_or(DVec3::ZERO, |n| n.as_dvec3());
            VertexRecord {
                position: quantiser.quantise(points[k]),
                uv: range.quantise(uvs[k].to_array()),
                normal: encode_axis(normal.try_normalize().unwrap_or(face)),
            }
        });
        TriangleRecord { corners, material, size: size.bits() }
    }
}

/// The colours of triangle `i`.
pub(crate) fn colors(soup: &TriangleSoup, i: usize) -> TriangleColors {
    soup.triangles[i].map(|v| {
        let [r, g, b, a] = soup.colors[v as usize];
        let [r, g, b] = [r, g, b].map(linear_to_srgb8);
        [r, g, b, (a * 255.0).round().clamp(0.0, 255.0) as u8]
    })
}

/// Coordinates beyond this many repeats are an exporter's garbage (their own spacing is then a tenth
/// of a texture): they are read as zero, and so do not spoil the material's steps.
const FARTHEST_UV: f32 = 1e6;

/// Texture coordinates of triangle `i`, moved by whole repeats of a wrapping texture to start in
/// 0..1 (0..2 under mirrors): quantised steps are then small, however often the bark repeats.
fn near_zero(soup: &TriangleSoup, i: usize, wraps: [Wrap; 2]) -> [Vec2; 3] {
    if soup.uvs.is_empty() {
        return [Vec2::ZERO; 3];
    }
    let uvs = soup.triangles[i].map(|v| soup.uvs[v as usize]);
    let uvs = uvs.map(|uv| if uv.abs().max_element() < FARTHEST_UV { uv } else { Vec2::ZERO });
    let least = uvs[0].min(uvs[1]).min(uvs[2]);
    let shift = |wrap: Wrap, v: f32| match wrap {
        Wrap::Repeat => v.floor(),
        Wrap::Mirror => (v * 0.5).floor() * 2.0,
        Wrap::Clamp => 0.0,
    };
    let shift = Vec2::new(shift(wraps[0], least.x), shift(wraps[1], least.y));
    uvs.map(|uv| uv - shift)
}

fn range(min: Vec2, max: Vec2) -> UvRange {
    if min.x > max.x {
        return UvRange { min: [0.0; 2], step: [0.0; 2] };
    }
    UvRange { min: min.to_array(), step: ((max - min) / f32::from(u16::MAX)).to_array() }
}
