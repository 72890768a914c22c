//! What the ground looks like: one vertex a point of the land, for every renderer.

use crate::file::LandSpec;
use crate::land::Land;
use bytemuck::{Pod, Zeroable};
use forest_points::record::{decode_axis, encode_axis};
use forest_soup::{Material, TriangleSoup, srgb8_to_linear};
use glam::Vec3;
use rayon::prelude::*;

/// A point of the land as it is drawn, 12 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct GroundVertex {
    /// Height in metres.
    pub height: f32,
    /// sRGB colour, and zero.
    pub color: [u8; 4],
    /// Normal: octahedral as of points, and two zeros.
    pub normal: [u8; 4],
}

/// Sines of the slopes at which the ground begins to look steep, and does altogether.
const STEEP: [f32; 2] = [0.35, 0.7];

/// The vertices of all points, rows of x from −z.
pub fn ground_vertices(land: &Land, spec: &LandSpec) -> Vec<GroundVertex> {
    let nx = land.points[0] as usize;
    let vertex = |i: usize| {
        let (x, z) = ((i % nx) as u32, (i / nx) as u32);
        let normal = land.normal(x, z);
        let slope = (1.0 - normal.y * normal.y).max(0.0).sqrt() as f32;
        let t = ((slope - STEEP[0]) / (STEEP[1] - STEEP[0])).clamp(0.0, 1.0);
        let mix = |k: usize| {
            let (a, b) = (f32::from(spec.color[k]), f32::from(spec.steep[k]));
            (a + (b - a) * t).round() as u8
        };
        let [u, v] = encode_axis(normal);
        GroundVertex {
            height: land.heights[i],
            color: [mix(0), mix(1), mix(2), 0],
            normal: [u, v, 0, 0],
        }
    };
    (0..land.heights.len()).into_par_iter().map(vertex).collect()
}

/// The land as triangles at full resolution: the ground truth's.
pub fn ground_soup(land: &Land, vertices: &[GroundVertex]) -> TriangleSoup {
    let [nx, nz] = land.points;
    let place = |i: usize| land.place(i as u32 % nx, i as u32 / nx).as_vec3();
    let color = |v: &GroundVertex| {
        let [r, g, b, _] = v.color;
        let [r, g, b] = [r, g, b].map(srgb8_to_linear);
        [r, g, b, 1.0]
    };
    let cell = |c: u32| {
        let first = c / (nx - 1) * nx + c % (nx - 1);
        let [a, b, d, e] = [first, first + 1, first + nx, first + nx + 1];
        // Counter-clockwise from above.
        [[a, e, b], [a, d, e]]
    };
    let triangles: Vec<[u32; 3]> = (0..(nx - 1) * (nz - 1)).flat_map(cell).collect();
    let normal = |v: &GroundVertex| -> Vec3 { decode_axis([v.normal[0], v.normal[1]]).as_vec3() };
    TriangleSoup {
        positions: (0..vertices.len()).map(place).collect(),
        normals: vertices.iter().map(normal).collect(),
        colors: vertices.iter().map(color).collect(),
        triangle_materials: vec![0; triangles.len()],
        triangles,
        materials: vec![Material::default()],
        ..TriangleSoup::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_soup_is_the_land() {
        let land = Land {
            points: [3, 2],
            size: [20.0, 10.0],
            heights: vec![0.0, 9.0, 0.0, 0.0, 0.0, 0.0],
        };
        let spec = LandSpec {
            size: 20.0,
            fractal: None,
            heightmap: None,
            color: [0, 100, 0],
            steep: [200, 100, 0],
        };
        let vertices = ground_vertices(&land, &spec);
        let soup = ground_soup(&land, &vertices);
        soup.validate().unwrap();
        assert_eq!(soup.triangles.len(), 4);
        for i in 0..4 {
            let [a, b, c] = soup.corners(i);
            assert!((b - a).cross(c - a).y > 0.0, "{i} faces down");
            let middle = ((a + b + c) / 3.0).as_dvec3();
            assert!((land.height(middle.x, middle.z) - middle.y).abs() < 1e-6);
        }
        // Flat at one end; at the other a slope of 9 in 10, whose sine is 0.669.
        assert_eq!(vertices[5].color, [0, 100, 0, 0]);
        assert_eq!(vertices[0].color[0], 182);
    }
}
