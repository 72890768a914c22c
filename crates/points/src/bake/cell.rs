//! Bakes one cell: triangles in, sorted records out.

use crate::bake::cells::CellSoup;
use crate::bake::cluster::{self, ClusterRules, Leaves, Tree};
use crate::bake::encode::{TriangleColors, TriangleEncoder, colors};
use crate::bake::frame::BlockFrame;
use crate::bake::lattice::{Lattice, Quantiser};
use crate::bake::node::Node;
use crate::bake::surfel::{Outcome, Surfel, SurfelMaker};
use crate::bake::timing::StageTimes;
use crate::header::BakeCounts;
use crate::options::{BakeOptions, Order};
use crate::record::PointRecord;
use crate::size::SizeCode;
use crate::triangle::TriangleRecord;
use forest_soup::{Bounds, TriangleSoup};
use hashbrown::HashTable;
use hashbrown::hash_table::Entry;

/// What all cells share.
pub(crate) struct CellBaker<'a> {
    pub(crate) frame: BlockFrame,
    pub(crate) lattice: Lattice,
    pub(crate) options: &'a BakeOptions,
    /// None to bake points only.
    pub(crate) encoder: Option<TriangleEncoder>,
}

/// A finished cell.
pub(crate) struct BakedCell {
    pub(crate) bounds: Bounds,
    pub(crate) quantiser: Quantiser,
    pub(crate) root: Node,
    pub(crate) points: Vec<PointRecord>,
    pub(crate) triangles: Vec<TriangleRecord>,
    pub(crate) colors: Vec<TriangleColors>,
    pub(crate) surfels: u32,
}

/// A triangle that is represented, and the size of its surfels.
pub(crate) struct Kept {
    triangle: u32,
    size: SizeCode,
}

impl CellBaker<'_> {
    /// Bakes a cell; `None` if nothing of it is visible.
    pub(crate) fn bake(
        &self,
        cell: &CellSoup,
        maker: &mut SurfelMaker,
        counts: &mut BakeCounts,
        times: &mut StageTimes,
    ) -> Option<BakedCell> {
        let (surfels, kept) = times.surfels.time(|| self.surfels(cell, maker, counts));
        if surfels.is_empty() {
            return None;
        }
        let bounds = cell.bounds(&self.frame);
        let quantiser = self.lattice.quantiser(bounds);
        let rules = self.rules(Leaves::Surfels(&surfels), quantiser);
        let mut tree = Tree::default();
        let root = times.cluster.time(|| cluster::build(&rules, &mut tree).root);
        let points = times.sort.time(|| sort(&tree.records, self.options.order));
        counts.points += points.len() as u64;
        let (triangles, colors) =
            times.triangles.time(|| self.triangles(&cell.soup, kept, &quantiser));
        let surfels = surfels.len() as u32;
        Some(BakedCell { bounds, quantiser, root, points, triangles, colors, surfels })
    }

    pub(crate) fn rules<'b>(&self, leaves: Leaves<'b>, quantiser: Quantiser) -> ClusterRules<'b> {
        let monotone = self.options.order == Order::Exact;
        ClusterRules { leaves, radius: self.options.radius, monotone, quantiser }
    }

    pub(crate) fn surfels(
        &self,
        cell: &CellSoup,
        maker: &mut SurfelMaker,
        counts: &mut BakeCounts,
    ) -> (Vec<Surfel>, Vec<Kept>) {
        let (soup, triangles) = (&*cell.soup, &*cell.list);
        let mut surfels = Vec::with_capacity(triangles.len());
        let mut kept = Vec::with_capacity(triangles.len());
        let mut seen = Seen::with_capacity(triangles.len());
        for &triangle in triangles {
            let i = triangle as usize;
            if !seen.insert(soup, triangle) {
                counts.duplicate += 1;
                continue;
            }
            match maker.push(soup, i, &mut surfels) {
                Outcome::ZeroArea => counts.zero_area += 1,
                Outcome::Transparent => counts.transparent += 1,
                Outcome::Surfels(n) => {
                    counts.surfels += u64::from(n);
                    let last = &surfels[surfels.len() - 1];
                    let size = Node::of_surfel(last, self.options.radius).own;
                    kept.push(Kept { triangle, size });
                }
            }
        }
        (surfels, kept)
    }

    fn triangles(
        &self,
        soup: &TriangleSoup,
        mut kept: Vec<Kept>,
        quantiser: &Quantiser,
    ) -> (Vec<TriangleRecord>, Vec<TriangleColors>) {
        let Some(encoder) = &self.encoder else { return (Vec::new(), Vec::new()) };
        kept.sort_by_key(|k| std::cmp::Reverse(k.size));
        let record = |k: &Kept| encoder.encode(soup, k.triangle as usize, k.size, quantiser);
        let records = kept.iter().map(record).collect();
        let colors = if encoder.colors {
            kept.iter().map(|k| colors(soup, k.triangle as usize)).collect()
        } else {
            Vec::new()
        };
        (records, colors)
    }
}

/// Sorts by the order's key, descending; equal keys keep the tree's order, which is local in space.
pub(crate) fn sort(points: &[PointRecord], order: Order) -> Vec<PointRecord> {
    let key = |p: &PointRecord| {
        let code = match order {
            Order::Exact => p.parent(),
            Order::Paper => p.own(),
        };
        usize::from(SizeCode::INFINITE.bits() - code.bits())
    };
    let mut next = vec![0usize; usize::from(SizeCode::INFINITE.bits()) + 2];
    for p in points {
        next[key(p) + 1] += 1;
    }
    for k in 1..next.len() {
        next[k] += next[k - 1];
    }
    let mut sorted = vec![bytemuck::Zeroable::zeroed(); points.len()];
    for p in points {
        let slot = &mut next[key(p)];
        sorted[*slot] = *p;
        *slot += 1;
    }
    sorted
}

/// Triangles met so far, by their corners in any order and their material. Equal triangles have
/// equal centroids, so that they meet in one cell.
struct Seen {
    table: HashTable<u32>,
}

type Corners = [[u32; 3]; 3];

impl Seen {
    fn with_capacity(n: usize) -> Self {
        Self { table: HashTable::with_capacity(n) }
    }

    /// Whether the triangle is new.
    fn insert(&mut self, soup: &TriangleSoup, triangle: u32) -> bool {
        let identity = |t: u32| (corners(soup, t), soup.triangle_materials[t as usize]);
        let mine = identity(triangle);
        let hash = |id: &(Corners, u16)| mix(&id.0);
        match self.table.entry(mix(&mine.0), |&t| identity(t) == mine, |&t| hash(&identity(t))) {
            Entry::Occupied(_) => false,
            Entry::Vacant(slot) => {
                slot.insert(triangle);
                true
            }
        }
    }
}

/// Corners as bits (−0 as 0), in ascending order.
fn corners(soup: &TriangleSoup, t: u32) -> Corners {
    let mut c = soup.corners(t as usize).map(|p| p.to_array().map(|v| (v + 0.0).to_bits()));
    c.sort_unstable();
    c
}

fn mix(c: &Corners) -> u64 {
    let mut hash = 0x9e37_79b9_7f4a_7c15u64;
    for &word in c.as_flattened() {
        hash = (hash.rotate_left(23) ^ u64::from(word)).wrapping_mul(0xff51_afd7_ed55_8ccd);
    }
    hash ^ hash >> 29
}
