//! Every place where parallel rays meet a soup, not only the first: what volumes measure.

use crate::mesh::corners;
use crate::opacity::covers;
use crate::plane::Edges;
use crate::surface::Surfaces;
use forest_soup::{Camera, Projection, TriangleSoup};
use glam::DVec2;
use rayon::prelude::*;

/// A place where the ray through the middle of a pixel meets a triangle that covers it there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayerHit {
    /// Row and column of the pixel: `y · width + x`.
    pub pixel: u32,
    /// Depth along the camera's axis, in world units.
    pub depth: f32,
}

/// Triangles that one task works on.
const CHUNK: usize = 4096;

/// Everything that the rays through the pixels' middles meet, in the order of the triangles. What
/// is partly transparent counts by the hash rule of opacity. Triangles that are not finite or seen
/// edge-on meet nothing.
///
/// # Panics
/// If `camera` is not parallel, or the soup breaks its own rules.
pub fn layers(soup: &TriangleSoup, surfaces: &Surfaces, camera: &Camera) -> Vec<LayerHit> {
    assert!(matches!(camera.projection, Projection::Orthographic { .. }), "parallel rays");
    let chunks: Vec<Vec<LayerHit>> = (0..soup.triangles.len())
        .into_par_iter()
        .step_by(CHUNK)
        .map(|first| {
            let mut hits = Vec::new();
            for i in first..(first + CHUNK).min(soup.triangles.len()) {
                triangle(soup, surfaces, camera, i, &mut hits);
            }
            hits
        })
        .collect();
    chunks.concat()
}

fn triangle(
    soup: &TriangleSoup,
    surfaces: &Surfaces,
    camera: &Camera,
    i: usize,
    hits: &mut Vec<LayerHit>,
) {
    let corners = corners(soup, i);
    let Some(surface) = surfaces.get(soup.triangle_materials[i]) else { return };
    if !corners.iter().all(|c| c.position.is_finite()) {
        return;
    }
    let projected = corners.map(|c| camera.project(c.position));
    let at = projected.map(|(x, y, _)| DVec2::new(x, y));
    let Some(edges) = Edges::new(at) else { return };
    let min = at[0].min(at[1]).min(at[2]) - 0.5;
    let max = at[0].max(at[1]).max(at[2]) - 0.5;
    // First and last pixel whose middle may lie inside; `as` saturates.
    let columns = (min.x.ceil().max(0.0) as u32, (max.x.floor() + 1.0).max(0.0) as u32);
    let rows = (min.y.ceil().max(0.0) as u32, (max.y.floor() + 1.0).max(0.0) as u32);
    for y in rows.0..rows.1.min(camera.height) {
        for x in columns.0..columns.1.min(camera.width) {
            let w = edges.weights(f64::from(x) + 0.5, f64::from(y) + 0.5);
            if w.iter().any(|w| *w < 0.0) {
                continue;
            }
            let total: f64 = w.iter().sum();
            let share = w.map(|w| w / total);
            if surface.translucent {
                let s = share.map(|v| v as f32);
                let uv = corners[0].uv * s[0] + corners[1].uv * s[1] + corners[2].uv * s[2];
                let tint: f32 = (0..3).map(|k| corners[k].color[3] * s[k]).sum();
                let coverage = (surface.coverage(uv, tint) * 255.0).round() as u8;
                if !covers(i as u32, x, y, coverage) {
                    continue;
                }
            }
            let depth: f64 = (0..3).map(|k| projected[k].2 * share[k]).sum();
            hits.push(LayerHit { pixel: y * camera.width + x, depth: depth as f32 });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Style, rasterize};
    use forest_soup::Material;
    use glam::{DVec3, Vec3};

    #[test]
    fn finds_hidden_layers_and_the_first_agrees_with_the_picture() {
        // Two slanted squares one behind the other.
        let square = |z: f32| {
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
                .map(|[x, y]: [f32; 2]| Vec3::new(x, y, z + 0.3 * x))
        };
        let soup = TriangleSoup {
            positions: [square(0.0), square(-2.0)].concat(),
            triangles: vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
            triangle_materials: vec![0; 4],
            materials: vec![Material::default()],
            ..TriangleSoup::default()
        };
        let surfaces = Surfaces::new(&soup.materials, &soup.textures);
        let projection = Projection::Orthographic { height: 4.0 };
        let camera = Camera::new(DVec3::new(0.1, 0.0, 5.0), -DVec3::Z, projection, [40, 40]);
        let hits = layers(&soup, &surfaces, &camera);
        let style = Style { sampling: crate::Sampling::MIDDLE, ..Style::default() };
        let picture = rasterize(&soup, &surfaces, &camera, &style);
        let mut first = vec![(f32::INFINITY, 0); 1600];
        for h in &hits {
            let (depth, n) = &mut first[h.pixel as usize];
            (*depth, *n) = (depth.min(h.depth), *n + 1);
        }
        for ((depth, n), seen) in first.iter().zip(&picture.depth) {
            assert!(depth == seen || (depth - seen).abs() < 1e-5, "{depth} {seen}");
            assert!(matches!(n, 0 | 2..=4), "{n}"); // two layers; more on a shared edge
        }
        assert!(hits.len() >= 800, "{}", hits.len()); // a quarter of the picture, twice
    }
}
