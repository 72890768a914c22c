//! The frame that all views of an atlas share.

use crate::directions::Directions;
use crate::header::ViewFrame;
use crate::options::Fit;
use forest_soup::{Camera, Projection, TriangleSoup};
use glam::DVec3;
use rayon::prelude::*;

/// Place and size of all tiles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Their middle, in the world.
    pub center: DVec3,
    /// Half their side, in world units.
    pub half: f64,
    /// Radius of the ball about the centre that holds the source.
    pub radius: f64,
    /// The source's box about the centre.
    pub bounds: [DVec3; 2],
    /// Radius of the box's own sphere: what `half` would be without fitting.
    pub sphere: f64,
}

impl Frame {
    /// The camera of the view from direction `from`, with `texels` a side: two radii away from the
    /// centre.
    pub fn camera(&self, from: DVec3, texels: u32) -> Camera {
        let eye = self.center + from * self.eye_distance();
        let projection = Projection::Orthographic { height: 2.0 * self.half };
        Camera::new(eye, -from, projection, [texels; 2])
    }

    /// From the eye to the centre.
    pub(crate) fn eye_distance(&self) -> f64 {
        2.0 * self.radius
    }

    /// The frame of the finite triangles of `soup` in views from `directions`; `None` if nothing
    /// of it has an extent.
    pub fn of(soup: &TriangleSoup, directions: &Directions, fit: Fit) -> Option<Self> {
        let bounds = soup.bounds();
        if bounds.is_empty() || bounds.half_diagonal() <= 0.0 {
            return None;
        }
        let middle = bounds.center();
        let mut used = vec![false; soup.positions.len()];
        for t in 0..soup.triangles.len() {
            if soup.corners(t).iter().all(|p| p.is_finite()) {
                soup.triangles[t].iter().for_each(|&v| used[v as usize] = true);
            }
        }
        let used = used.iter().zip(&soup.positions).filter(|u| *u.0);
        let points: Vec<DVec3> = used.map(|(_, p)| p.as_dvec3() - middle).collect();
        let radius = points.par_iter().map(|p| p.length()).reduce(|| 0.0, f64::max);
        let sphere = bounds.half_diagonal();
        let half = match fit {
            Fit::Sphere => sphere,
            Fit::Tight => (0..directions.count())
                .into_par_iter()
                .map(|i| {
                    let ViewFrame { right, up, .. } = ViewFrame::new(directions.direction(i));
                    let reach = |p: &DVec3| p.dot(right).abs().max(p.dot(up).abs());
                    points.iter().map(reach).fold(0.0, f64::max)
                })
                .reduce(|| 0.0, f64::max)
                .min(sphere),
        };
        let size = bounds.size() * 0.5;
        // A flat thing seen edge-on from everywhere has no picture; one that is seen has some width.
        (half > 0.0).then_some(Self {
            center: soup.origin + middle,
            half,
            radius,
            bounds: [-size, size],
            sphere,
        })
    }
}
