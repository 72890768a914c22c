//! Opacity of cells from a mesh: rays along the axes are counted.

use crate::cells::Opacity;
use crate::lattice::Lattice;
use forest_raster::{Surfaces, layers};
use forest_soup::{Camera, Projection, TriangleSoup};
use glam::{DVec3, UVec3};
use rayon::prelude::*;

/// Rays along a side of the lattice, about.
const RAYS: u32 = 1024;

/// For each cell of each level the share of the rays through it, along the three axes, that meet
/// the soup within it. What stands one behind the other in a cell counts once: the coverage of the
/// union, not the sum of areas.
pub(crate) fn coverage(lattice: &Lattice, soup: &TriangleSoup, surfaces: &Surfaces) -> Opacity {
    let finest = lattice.cells(lattice.levels);
    // Whole rays a cell, evenly between its walls.
    let rays = finest * RAYS.div_ceil(finest).max(2);
    let mut counts: Vec<Vec<u32>> =
        (0..=lattice.levels).map(|l| vec![0; (lattice.cells(l) as usize).pow(3)]).collect();
    for axis in 0..3 {
        count(lattice, axis, rays, soup, surfaces, &mut counts);
    }
    let share = |(level, counts): (u32, Vec<u32>)| {
        let a_side = rays / lattice.cells(level);
        let scale = 1.0 / (3 * a_side * a_side) as f32;
        counts.into_par_iter().map(|n| n as f32 * scale).collect()
    };
    Opacity((0..).zip(counts).map(share).collect())
}

/// Adds the rays along one axis.
fn count(
    lattice: &Lattice,
    axis: usize,
    rays: u32,
    soup: &TriangleSoup,
    surfaces: &Surfaces,
    counts: &mut [Vec<u32>],
) {
    let forward = DVec3::AXES[axis];
    let eye = lattice.middle() - forward * lattice.side;
    let projection = Projection::Orthographic { height: lattice.side };
    let camera = Camera::new(eye, forward, projection, [rays; 2]);
    let hits = layers(soup, surfaces, &camera);
    let finest = lattice.cells(lattice.levels);
    let scale = f64::from(finest) / lattice.side;
    // Ray, and finest cell along it.
    let mut places: Vec<(u32, u32)> = hits
        .into_par_iter()
        .map(|h| {
            let along = (f64::from(h.depth) - 0.5 * lattice.side) * scale;
            (h.pixel, (along.max(0.0) as u32).min(finest - 1))
        })
        .collect();
    places.par_sort_unstable();
    places.dedup();
    let (right, down) = (camera.right.abs().max_position(), camera.up.abs().max_position());
    let factor = lattice.branching.factor();
    for (level, counts) in (0..).zip(counts) {
        let n = lattice.cells(level);
        let (across, deep) = (rays / n, factor.pow(lattice.levels - level));
        let mut before = None;
        for &(pixel, along) in &places {
            let (x, y) = (pixel % rays / across, pixel / rays / across);
            let cell = along / deep;
            if before.replace((pixel, cell)) == Some((pixel, cell)) {
                continue;
            }
            let mut place = UVec3::ZERO;
            place[axis] = cell;
            place[right] = if camera.right[right] > 0.0 { x } else { n - 1 - x };
            place[down] = if camera.up[down] < 0.0 { y } else { n - 1 - y };
            counts[lattice.dense(level, place)] += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::Branching;
    use forest_soup::Material;
    use glam::Vec3;

    fn soup(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> TriangleSoup {
        TriangleSoup {
            positions,
            triangle_materials: vec![0; triangles.len()],
            triangles,
            materials: vec![Material::default()],
            ..TriangleSoup::default()
        }
    }

    fn measured(soup: &TriangleSoup, branching: Branching, levels: u32) -> (Lattice, Opacity) {
        let lattice = Lattice { corner: DVec3::ZERO, side: 1.0, branching, levels };
        let surfaces = Surfaces::new(&soup.materials, &soup.textures);
        (lattice, coverage(&lattice, soup, &surfaces))
    }

    #[test]
    fn a_wall_stops_its_own_share_of_three_axes() {
        // x in ¼ … ¾, y in 0 … 1, at z = 0.3: twice, which counts once.
        let corner = |x: f32, y: f32| Vec3::new(x, y, 0.3);
        let wall = [corner(0.25, 0.0), corner(0.75, 0.0), corner(0.75, 1.0), corner(0.25, 1.0)];
        let faces = vec![[0, 1, 2], [0, 2, 3], [0, 1, 2], [0, 2, 3]];
        for branching in [Branching::Octree, Branching::TriGrid] {
            let (lattice, opacity) = measured(&soup(wall.to_vec(), faces.clone()), branching, 3);
            assert!((opacity.0[0][0] - 0.5 / 3.0).abs() < 2e-3, "{}", opacity.0[0][0]);
            let n = lattice.cells(3);
            let z = (0.3 * f64::from(n)) as u32;
            for i in 0..n * n * n {
                let place = UVec3::new(i % n, i / n % n, i / (n * n));
                let (a, b) =
                    (f64::from(place.x) / f64::from(n), f64::from(place.x + 1) / f64::from(n));
                let inside = (b.min(0.75) - a.max(0.25)).max(0.0) * f64::from(n);
                let want = if place.z == z { inside / 3.0 } else { 0.0 };
                let got = f64::from(opacity.0[3][lattice.dense(3, place)]);
                assert!((got - want).abs() < 0.03, "{place} {got} {want}");
            }
        }
    }

    #[test]
    fn each_axis_sees_its_own_places() {
        // A small triangle in the cell (1, 2, 3) of a grid of four, slanted to all axes.
        let at = |x: f32, y: f32, z: f32| Vec3::new(1.0 + x, 2.0 + y, 3.0 + z) / 4.0;
        let leaf =
            soup(vec![at(0.9, 0.1, 0.1), at(0.1, 0.9, 0.1), at(0.1, 0.1, 0.9)], vec![[0, 1, 2]]);
        let (lattice, opacity) = measured(&leaf, Branching::Octree, 2);
        let cell = lattice.dense(2, UVec3::new(1, 2, 3));
        // A right triangle of sides 0.8 from each side.
        assert!((opacity.0[2][cell] - 0.32).abs() < 2e-3, "{}", opacity.0[2][cell]);
        assert_eq!(opacity.0[2].iter().filter(|v| **v > 0.0).count(), 1);
        assert!((opacity.0[0][0] - 0.32 / 16.0).abs() < 2e-4);
    }
}
