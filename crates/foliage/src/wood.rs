//! The wood of a tree: its skeleton, and which of its triangles belong to which branch.

use crate::branch::{Branches, OnBranch};
use crate::skeleton::Rings;
use crate::weld::Welded;
use crate::wind::Rig;
use crate::wood_graph::{Place, WoodGraph};
use forest_soup::Bounds;
use glam::DVec3;
use rstar::RTree;

/// Wood with its skeleton.
pub(crate) struct Wood {
    pub(crate) welded: Welded,
    pub(crate) branches: Branches,
    pub(crate) rig: Rig,
    /// Where on the branches each welded corner lies.
    pub(crate) places: Vec<OnBranch>,
    /// Numbers in the soup of each branch's triangles.
    pub(crate) triangles: Vec<Vec<u32>>,
    /// Separate pieces that were tied together.
    pub(crate) pieces: usize,
    near: RTree<Place>,
    /// Of all corners of the graph, cut edges included.
    near_places: Vec<OnBranch>,
}

/// Edges of the graph are at most this share of the tree's size, level sets as many of them apart.
const EDGE: f64 = 1.0 / 160.0;
const LEVEL: f64 = 1.5;

/// Least height of that trunk, in sizes of the tree: leaves may lie flat.
const LOWEST: f64 = 0.01;

/// Thickness of the trunk that is made up for trees without wood, in heights.
const MADE_UP: f64 = 0.01;

impl Wood {
    /// The skeleton of welded wood of a tree in this box; without any wood, a straight trunk from
    /// the middle of its bottom to the middle of its top.
    pub(crate) fn new(welded: Welded, bounds: &Bounds) -> Self {
        let size = bounds.size().max_element();
        let graph = WoodGraph::new(&welded, size * EDGE);
        let (branches, corners) = if graph.positions.is_empty() {
            let at = |y: f64| DVec3::new(bounds.center().x, y, bounds.center().z);
            let height = bounds.size().y.max(LOWEST * size);
            let (base, tip) = (at(bounds.min.y), at(bounds.min.y + height));
            (Branches::trunk(base, tip, MADE_UP * height), Vec::new())
        } else {
            let rings = Rings::new(&graph, size * EDGE * LEVEL);
            let (branches, of_rings) = Branches::of(&rings);
            let corners = branches.places(&graph, &rings, &of_rings);
            (branches, corners)
        };
        let mut triangles = vec![Vec::new(); branches.branches.len()];
        for (t, &source) in welded.triangles.iter().zip(&welded.sources) {
            // Between two branches: the one that leaves the other.
            let of = t.map(|v| corners[v as usize].branch);
            triangles[of.into_iter().max().unwrap_or(0) as usize].push(source);
        }
        let (rig, near) = (Rig::new(&branches), graph.places());
        let places = corners[..welded.positions.len()].to_vec();
        let pieces = graph.pieces;
        Self { welded, branches, rig, places, triangles, pieces, near, near_places: corners }
    }

    /// The place on a branch that is nearest to `p`, and its distance.
    pub(crate) fn nearest(&self, p: DVec3) -> (OnBranch, f64) {
        match self.near.nearest_neighbor(p.to_array()) {
            Some(found) => {
                let on = self.near_places[found.data as usize];
                // Between corners: where the branch itself is nearest.
                let at = self.branches.branches[on.branch as usize].nearest(p);
                (OnBranch { at, ..on }, p.distance(DVec3::from_array(*found.geom())))
            }
            None => {
                let at = self.branches.branches[0].nearest(p);
                (OnBranch { branch: 0, at }, p.distance(self.branches.branches[0].sample(at).0))
            }
        }
    }

    /// Where the corners of triangle `source` of the soup lie, which is wood.
    pub(crate) fn corners(&self, source: u32) -> [OnBranch; 3] {
        let number = self.welded.sources.binary_search(&source).expect("a triangle of wood");
        self.welded.triangles[number].map(|v| self.places[v as usize])
    }

    /// Of each branch, the group of thin ones that it belongs to: the number of the first of them on
    /// the way from the trunk; `None` if it is thick. Thin are branches whose radius is below
    /// `thinnest` at the base, with all that grows from them.
    pub(crate) fn groups(&self, thinnest: f64) -> Vec<Option<u32>> {
        let mut out: Vec<Option<u32>> = Vec::new();
        for (i, branch) in (0..).zip(&self.branches.branches) {
            let above = branch.parent.and_then(|p| out[p as usize]);
            let own = (branch.base_radius() < thinnest).then_some(i);
            out.push(above.or(own));
        }
        out
    }
}
