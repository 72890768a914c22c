//! A soup by scanlines: the fast way, without shadows or with those of a map.

use crate::canvas::{Style, draw};
use crate::list::{Corner, DisplayList, Projector};
use crate::picture::Picture;
use crate::shadow::ShadowMap;
use crate::surface::Surfaces;
use forest_soup::{Camera, TriangleSoup};
use glam::{Vec2, Vec3};
use rayon::prelude::*;
use std::sync::Arc;

/// Triangles that one task projects.
const CHUNK: usize = 4096;

/// Draws `soup` as `camera` sees it. `surfaces` are those of the soup's materials. Triangles with
/// corners that are not finite are left out.
///
/// # Panics
/// If the soup breaks its own rules ([`TriangleSoup::validate`]).
pub fn rasterize(
    soup: &TriangleSoup,
    surfaces: &Surfaces,
    camera: &Camera,
    style: &Style,
) -> Picture {
    draw(&display_list(soup, surfaces, camera), camera, style)
}

/// As [`rasterize`], with the shadows of a map.
///
/// # Panics
/// If the soup breaks its own rules ([`TriangleSoup::validate`]).
pub fn rasterize_shadowed(
    soup: &TriangleSoup,
    surfaces: &Surfaces,
    camera: &Camera,
    style: &Style,
    map: Arc<ShadowMap>,
) -> Picture {
    let mut list = display_list(soup, surfaces, camera);
    list.shade(map);
    draw(&list, camera, style)
}

/// The soup as `camera` sees it; a triangle's id is its number in the soup.
fn display_list<'a>(
    soup: &TriangleSoup,
    surfaces: &'a Surfaces,
    camera: &Camera,
) -> DisplayList<'a> {
    let projector = Projector::new(camera, 1e-6 * extent(soup));
    let lists: Vec<DisplayList> = (0..soup.triangles.len())
        .into_par_iter()
        .step_by(CHUNK)
        .map(|first| {
            let mut list = DisplayList::default();
            for i in first..(first + CHUNK).min(soup.triangles.len()) {
                let corners = corners(soup, i);
                list.triangle(&projector, surfaces, soup.triangle_materials[i], i as u32, corners);
            }
            list
        })
        .collect();
    let mut all = DisplayList::default();
    lists.into_iter().for_each(|list| all.append(list));
    all
}

/// Corners of triangle `i` with their attributes.
pub(crate) fn corners(soup: &TriangleSoup, i: usize) -> [Corner; 3] {
    soup.triangles[i].map(|v| {
        let v = v as usize;
        Corner {
            position: soup.origin + soup.positions[v].as_dvec3(),
            normal: soup.normals.get(v).copied().unwrap_or(Vec3::ZERO),
            uv: soup.uvs.get(v).copied().unwrap_or(Vec2::ZERO),
            color: soup.colors.get(v).copied().unwrap_or([1.0; 4]),
            sunlit: soup.sunlit.get(v).copied().unwrap_or(1.0),
            skylit: soup.skylit.get(v).copied().unwrap_or(1.0),
        }
    })
}

/// The longest side of the box around a soup; 0 for nothing.
pub(crate) fn extent(soup: &TriangleSoup) -> f64 {
    let bounds = soup.bounds();
    if bounds.is_empty() { 0.0 } else { bounds.size().max_element() }
}
