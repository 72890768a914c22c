//! Photographs of a mesh, where there are none of the tree: parallel, and deep.

use crate::lattice::Lattice;
use forest_raster::{Buffers, CaptureScene, DeepPicture};
use forest_soup::{Camera, PhotoCamera, Photograph, Projection};
use glam::DVec3;
use rayon::prelude::*;

/// Where a mesh is photographed from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stand {
    /// All around from the horizon up, evenly over the half sphere.
    Dome {
        /// Number of cameras, ≥ 1.
        cameras: u32,
    },
    /// In a ring, as one walks around a tree.
    Ring {
        /// Number of cameras, ≥ 1.
        cameras: u32,
        /// Angle above the horizon in degrees.
        elevation: f64,
    },
}

/// Most cameras: masks of billboards stay small.
pub(crate) const MAX_CAMERAS: u32 = 256;

impl Stand {
    /// Unit vectors from the tree towards the cameras; y is up.
    pub fn directions(&self) -> Vec<DVec3> {
        let polar = |azimuth: f64, sin: f64| {
            let flat = (1.0 - sin * sin).max(0.0).sqrt();
            DVec3::new(azimuth.sin() * flat, sin, azimuth.cos() * flat)
        };
        match *self {
            // Equal steps in height, turning by the golden angle: equal areas.
            Self::Dome { cameras } => (0..cameras)
                .map(|i| {
                    let sin = (f64::from(i) + 0.5) / f64::from(cameras);
                    polar(f64::from(i) * 2.399_963_229_728_653, sin)
                })
                .collect(),
            Self::Ring { cameras, elevation } => (0..cameras)
                .map(|i| {
                    let azimuth = f64::from(i) / f64::from(cameras) * std::f64::consts::TAU;
                    polar(azimuth, elevation.to_radians().sin())
                })
                .collect(),
        }
    }
}

/// What cells are textured from: a camera, and what its pixels show.
pub(crate) struct Shot<'a> {
    pub(crate) camera: PhotoCamera,
    pub(crate) seen: Seen<'a>,
}

impl<'a> Shot<'a> {
    pub(crate) fn of(photo: &'a Photograph) -> Self {
        Self { camera: photo.camera, seen: Seen::Photograph(photo) }
    }
}

/// What pixels show.
pub(crate) enum Seen<'a> {
    /// sRGB and a matte, of things at unknown depths.
    Photograph(&'a Photograph),
    /// Things at known depths, one behind the other.
    Deep(DeepPicture),
}

/// Rays along the side of a texel, at least: billboards are up to √3 times as wide as their cells.
const RAYS_A_TEXEL: f64 = 1.5;

/// Longest side of a photograph.
const MAX_SIDE: f64 = 8192.0;

/// Finest cells in a slab: within it one thing hides another.
const CELLS_A_SLAB: f64 = 4.0;

/// Deep photographs of what stands in the box `bounds` (its corners, in the world), as fine as
/// billboards of `texels` need it.
pub(crate) fn photographs(
    scene: &CaptureScene,
    bounds: [DVec3; 2],
    lattice: &Lattice,
    texels: u32,
    stand: Stand,
) -> Vec<Shot<'static>> {
    let cell = lattice.cell_side(lattice.levels);
    let wanted = cell / (f64::from(texels) * RAYS_A_TEXEL);
    let middle = (bounds[0] + bounds[1]) * 0.5;
    let half = (bounds[1] - bounds[0]) * 0.5;
    // Coarse trees need no thicker slabs than a few dozen of them.
    let slab = (CELLS_A_SLAB * cell).min(lattice.side / 16.0);
    stand
        .directions()
        .into_par_iter()
        .map_init(Buffers::default, |buffers, from| {
            let eye = middle + from * (2.0 * half.length());
            let unit = Projection::Orthographic { height: 1.0 };
            let frame = Camera::new(eye, -from, unit, [1, 1]);
            let reach = [frame.right, frame.up].map(|v| 2.0 * v.abs().dot(half));
            let pixel = wanted.max(reach[0].max(reach[1]) / MAX_SIDE);
            let size = reach.map(|r| (r / pixel).ceil() as u32 + 2);
            let height = f64::from(size[1]) * pixel;
            let camera = Camera::new(eye, -from, Projection::Orthographic { height }, size);
            let seen = Seen::Deep(scene.deep(&camera, slab, buffers));
            Shot { camera: PhotoCamera::from(&camera), seen }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stands_are_where_they_are_said_to_be() {
        let ring = Stand::Ring { cameras: 4, elevation: 30.0 }.directions();
        assert!((ring[1] - DVec3::new(0.75f64.sqrt(), 0.5, 0.0)).length() < 1e-12);
        let dome = Stand::Dome { cameras: 16 }.directions();
        assert!(dome.iter().all(|d| (d.length() - 1.0).abs() < 1e-12 && d.y > 0.0));
        // Nobody is nearer to a camera than half the mean spacing of 16 on a half sphere.
        for (i, a) in dome.iter().enumerate() {
            assert!(dome[..i].iter().all(|b| a.angle_between(*b) > 0.33), "{i}");
        }
        assert_eq!(Stand::Dome { cameras: 1 }.directions().len(), 1);
    }
}
