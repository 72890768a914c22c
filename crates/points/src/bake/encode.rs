//! Triangles of the soup become triangle records.

use crate::bake::frame::BlockFrame;
use crate::bake::lattice::Quantiser;
use crate::record::encode_axis;
use crate::size::SizeCode;
use crate::triangle::{TriangleRecord, UvRange, VertexRecord};
use forest_soup::{TriangleSoup, Wrap, linear_to_srgb8};
use glam::{DVec3, Vec2};
use rayon::prelude::*;

/// Vertex colours of a triangle: sRGB and alpha, 8 bits each.
pub(crate) type TriangleColors = [[u8; 4]; 3];

/// Makes triangle records.
pub(crate) struct TriangleEncoder<'a> {
    soup: &'a TriangleSoup,
    frame: BlockFrame,
    wraps: Vec<[Wrap; 2]>,
    pub(crate) uv_ranges: Vec<UvRange>,
}

impl<'a> TriangleEncoder<'a> {
    pub(crate) fn new(soup: &'a TriangleSoup, frame: BlockFrame) -> Self {
        let wraps: Vec<[Wrap; 2]> = soup
            .materials
            .iter()
            .map(|m| m.texture.map_or([Wrap::Clamp; 2], |t| soup.textures[t as usize].wrap))
            .collect();
        let empty = || vec![(Vec2::INFINITY, Vec2::NEG_INFINITY); wraps.len()];
        let bounds = (0..soup.triangles.len())
            .into_par_iter()
            .with_min_len(1 << 14)
            .fold(empty, |mut b, i| {
                let m = soup.triangle_materials[i] as usize;
                for uv in near_zero(soup, i, wraps[m]) {
                    b[m] = (b[m].0.min(uv), b[m].1.max(uv));
                }
                b
            })
            .reduce(empty, |a, b| {
                a.iter().zip(&b).map(|(a, b)| (a.0.min(b.0), a.1.max(b.1))).collect()
            });
        let uv_ranges = bounds.into_iter().map(|(min, max)| range(min, max)).collect();
        Self { soup, frame, wraps, uv_ranges }
    }

    pub(crate) fn encode(&self, i: usize, size: SizeCode, quantiser: &Quantiser) -> TriangleRecord {
        let material = self.soup.triangle_materials[i];
        let range = self.uv_ranges[material as usize];
        let uvs = near_zero(self.soup, i, self.wraps[material as usize]);
        let points = self.soup.corners(i).map(|p| self.frame.map(p));
        let face = (points[1] - points[0]).cross(points[2] - points[0]).normalize_or(DVec3::Y);
        let corners = std::array::from_fn(|k| {
            let vertex = self.soup.triangles[i][k] as usize;
            let normal = self.soup.normals.get(vertex).map_or(DVec3::ZERO, |n| n.as_dvec3());
            VertexRecord {
                position: quantiser.quantise(points[k]),
                uv: range.quantise(uvs[k].to_array()),
                normal: encode_axis(normal.try_normalize().unwrap_or(face)),
            }
        });
        TriangleRecord { corners, material, size: size.bits() }
    }

    pub(crate) fn has_colors(&self) -> bool {
        !self.soup.colors.is_empty()
    }

    pub(crate) fn colors(&self, i: usize) -> TriangleColors {
        self.soup.triangles[i].map(|v| {
            let [r, g, b, a] = self.soup.colors[v as usize];
            let [r, g, b] = [r, g, b].map(linear_to_srgb8);
            [r, g, b, (a * 255.0).round().clamp(0.0, 255.0) as u8]
        })
    }
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
