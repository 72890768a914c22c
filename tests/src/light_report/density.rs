//! The density factor: how much light comes through the leaves around a place.
//!
//! Candussi, Candussi, Höllerer 2005 take "the number of leaves surrounding the current leaf",
//! computed beforehand. Here it is the area of leaves in a ball, and the light is what a medium of
//! leaves that face all ways lets through over the ball's radius (Beer, Lambert; a leaf hides half of
//! its area on average): a number without a scale to choose.

use forest_foliage::Part;
use forest_soup::TriangleSoup;
use glam::DVec3;
use rstar::RTree;
use rstar::primitives::GeomWithData;

/// Radius of the ball, in sizes of the tree.
const RADIUS: f64 = 0.1;

/// Leaves by their middles in the world, with their areas.
pub(crate) struct Density {
    leaves: RTree<GeomWithData<[f64; 3], f64>>,
    radius: f64,
}

impl Density {
    /// Of the triangles of a soup that are leaves.
    pub(crate) fn new(soup: &TriangleSoup, parts: &[Option<Part>]) -> Self {
        let leaf = |i: &usize| parts[*i] == Some(Part::Leaf);
        let place = |i: usize| {
            let [a, b, c] = soup.corners(i).map(|p| p.as_dvec3());
            let area = 0.5 * (b - a).cross(c - a).length();
            GeomWithData::new((soup.origin + (a + b + c) / 3.0).to_array(), area)
        };
        let leaves = (0..parts.len()).filter(leaf).map(place).collect();
        let radius = RADIUS * soup.bounds().size().max_element();
        Self { leaves: RTree::bulk_load(leaves), radius }
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
