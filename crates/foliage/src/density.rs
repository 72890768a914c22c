//! The density factor: how much light comes through the leaves around a place.
//!
//! Candussi, Candussi, Höllerer 2005 take "the number of leaves surrounding the current leaf",
//! computed beforehand. Here it is the area of leaves in a ball, and the light is what a medium of
//! leaves that face all ways lets through over the ball's radius (Beer, Lambert; a leaf hides half of
//! its area on average): a number without a scale to choose.

use crate::leaf::Leaf;
use glam::DVec3;
use rstar::RTree;
use rstar::primitives::GeomWithData;

/// Radius of the ball, in sizes of the tree.
const RADIUS: f64 = 0.1;

/// Leaves by their middles, with their areas.
pub(crate) struct Density {
    leaves: RTree<GeomWithData<[f64; 3], f64>>,
    radius: f64,
}

impl Density {
    pub(crate) fn new(leaves: &[Leaf], size: f64) -> Self {
        let place = |l: &Leaf| GeomWithData::new(l.center.to_array(), l.area);
        Self { leaves: RTree::bulk_load(leaves.iter().map(place).collect()), radius: RADIUS * size }
    }

    /// Share of light that comes through, `0..=1`.
    pub(crate) fn openness(&self, p: DVec3) -> f64 {
        let r = self.radius;
        let near = self.leaves.locate_within_distance(p.to_array(), r * r);
        let area: f64 = near.map(|l| l.data).sum();
        let density = area / (4.0 / 3.0 * std::f64::consts::PI * r.powi(3));
        (-0.5 * density * r).exp()
    }
}
