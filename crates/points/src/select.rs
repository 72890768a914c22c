//! Selection: what to draw of a block for a camera (Gilet et al. 2005, sections 5.1 and 5.2).
//!
//! Every cell gets two size codes from the thresholds at its distance: `fine` (from s_m) and
//! `coarse` (from s_M). Then, with integer comparisons only,
//!
//! * a triangle is drawn iff `size > coarse`;
//! * a surfel is drawn iff `parent > fine` and `own ≤ coarse`;
//! * a cluster's point is drawn iff `parent > fine` and `own ≤ fine`.
//!
//! In a pruned pack both codes are raised to its limits: what is finer is not there.
//! In a pack without triangles `coarse` is the largest size: all surfels may be drawn.
//!
//! Sizes grow towards the root, and a triangle has the size of its surfels, so that for any
//! thresholds every source triangle is represented exactly once. Points being sorted by their
//! parent's size, the first two words of each rule are a prefix of the cell's array.
//!
//! The block's own tree above the cells uses the threshold at the block's centre. A cell whose
//! root's parent is drawn, or below a drawn point, is left out; any other cell's threshold is kept
//! below that parent, so that the cut is valid across cells that choose differently.

use crate::block::PointsBlock;
use crate::header::CellRecord;
use crate::options::Order;
use crate::record::PointRecord;
use crate::size::SizeCode;
use forest_soup::{Camera, Projection};
use glam::DVec3;
use std::ops::Range;

/// An area on screen, in square pixels.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Default)]
pub struct PixelArea(pub f64);

/// What may be drawn how large. All are projected areas ("projected surface", section 5.1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thresholds {
    /// s_m: points smaller than this give way to their parent.
    pub finest: PixelArea,
    /// s_M: points larger than this give way to their triangle. At least s_m is used.
    pub largest: PixelArea,
    /// k: both are raised by k·Z, Z going from −1 at the block's front to 1 at its back.
    pub depth_bias: PixelArea,
}

impl Thresholds {
    /// s_M over s_m where only s_m is given.
    pub const LARGEST_RATIO: f64 = 16.0;

    /// All triangles and no point.
    pub const TRIANGLES: Self =
        Self { finest: PixelArea(0.0), largest: PixelArea(0.0), depth_bias: PixelArea(0.0) };

    /// Those of a level in a pack's measured table ([`forest_pack::measures::Measure::level`]).
    pub fn of_level([finest, largest, depth_bias]: [f32; 3]) -> Self {
        let area = |v: f32| PixelArea(f64::from(v));
        Self { finest: area(finest), largest: area(largest), depth_bias: area(depth_bias) }
    }
}

impl Default for Thresholds {
    /// Points of about a pixel, triangles above 16 pixels, no bias.
    fn default() -> Self {
        Self {
            finest: PixelArea(1.0),
            largest: PixelArea(Self::LARGEST_RATIO),
            depth_bias: PixelArea(0.0),
        }
    }
}

/// What to draw of one cell.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CellCut {
    /// Index of the cell.
    pub cell: u32,
    /// Points to look at: indices into the block's array.
    pub points: Range<u32>,
    /// Triangles to draw: indices into the block's array.
    pub triangles: Range<u32>,
    /// Largest size code of a cluster's point; −1 draws none.
    pub fine: i32,
    /// Largest size code of a surfel; −1 draws none.
    pub coarse: i32,
    order: Order,
}

impl CellCut {
    /// Whether a point of [`CellCut::points`] is drawn.
    #[inline]
    pub fn draws(&self, point: &PointRecord) -> bool {
        let own = i32::from(point.own().bits());
        match self.order {
            Order::Exact => own <= if point.is_leaf() { self.coarse } else { self.fine },
            Order::Paper => true,
        }
    }

    /// The drawn points: index in the block, cell and record.
    pub fn drawn_points<'a>(
        &'a self,
        block: &'a PointsBlock<'a>,
    ) -> impl Iterator<Item = (u32, &'a CellRecord, &'a PointRecord)> {
        let cell = &block.cells[self.cell as usize];
        let records = &block.points[self.points.start as usize..self.points.end as usize];
        let drawn = self.points.clone().zip(records).filter(|(_, p)| self.draws(p));
        drawn.map(move |(i, p)| (i, cell, p))
    }
}

/// What to draw of a block.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Cut {
    /// Cells with something to draw.
    pub cells: Vec<CellCut>,
}

impl Cut {
    /// The drawn points: index in the block, cell and record.
    pub fn points<'a>(
        &'a self,
        block: &'a PointsBlock<'a>,
    ) -> impl Iterator<Item = (u32, &'a CellRecord, &'a PointRecord)> {
        self.cells.iter().flat_map(|c| c.drawn_points(block))
    }

    /// Number of triangles to draw.
    pub fn triangle_count(&self) -> u64 {
        self.cells.iter().map(|c| c.triangles.len() as u64).sum()
    }
}

/// What to draw of `block` for `camera`.
pub fn select(block: &PointsBlock, camera: &Camera, thresholds: &Thresholds) -> Cut {
    let mut cut = Cut::default();
    select_into(block, camera, thresholds, &mut cut);
    cut
}

/// As [`select`], into a cut that is kept from frame to frame: allocates nothing once it has grown.
pub fn select_into(block: &PointsBlock, camera: &Camera, t: &Thresholds, cut: &mut Cut) {
    cut.cells.clear();
    let scale = block.scale();
    let distance = |p: DVec3| match camera.projection {
        Projection::Orthographic { .. } => (p - camera.eye).dot(camera.forward),
        Projection::Perspective { .. } => p.distance(camera.eye),
    };
    // Projected area to area in block space.
    let to_block = |area: f64, d: f64| {
        let pixels = camera.pixels_per_unit(d) * scale;
        // An infinite threshold stays one even where a pixel covers nothing.
        if area == f64::INFINITY { area } else { area.max(0.0) / (pixels * pixels) }
    };
    let d1 = distance(block.origin());
    let [least_fine, least_coarse] = block.limits();
    let block_fine = code(SizeCode::at_most(to_block(t.finest.0, d1))).max(least_fine);
    for (i, cell) in (0..).zip(block.cells) {
        let [x, y, z] = cell.center.map(f64::from);
        let d2 = distance(block.to_world(DVec3::new(x, y, z)));
        let root_parent = i32::from(cell.root_parent);
        let exact = block.header.order == Order::Exact;
        if exact && !cell.is_top() && root_parent <= block_fine {
            continue;
        }
        let depth = if cell.is_top() { 0.0 } else { (d2 - d1) / block.half_diagonal() };
        let bias = t.depth_bias.0 * depth;
        let fine_area = to_block(t.finest.0 + bias, d2);
        let coarse_area = to_block(t.largest.0 + bias, d2).max(fine_area);
        // Without triangles nothing can stand in for a surfel, however large.
        let coarse = if exact && block.triangles.is_empty() {
            i32::from(SizeCode::MAX.bits())
        } else {
            code(SizeCode::at_most(coarse_area)).max(least_coarse)
        };
        let (fine, points) = match block.header.order {
            Order::Exact => {
                let fine = if cell.is_top() {
                    block_fine
                } else {
                    code(SizeCode::at_most(fine_area)).max(least_fine).min(root_parent - 1)
                };
                (fine, exact_range(block, cell, fine))
            }
            Order::Paper => {
                let fine = i32::from(SizeCode::at_least(fine_area).bits());
                (fine, paper_range(block, cell, fine, coarse))
            }
        };
        // Triangles only: no point need be looked at.
        let points =
            if fine < 0 && coarse < 0 { cell.first_point..cell.first_point } else { points };
        let triangles = block.cell_triangles(cell);
        let drawn = triangles.partition_point(|t| i32::from(t.size) > coarse) as u32;
        let triangles = cell.first_triangle..cell.first_triangle + drawn;
        if !points.is_empty() || !triangles.is_empty() {
            let order = block.header.order;
            cut.cells.push(CellCut { cell: i, points, triangles, fine, coarse, order });
        }
    }
}

/// The finest cut of at most `most` points and triangles: all triangles if they are so few and `ratio` is
/// finite, else thresholds s_m, s_M = `ratio`·s_m without depth bias, and what they draw. Counts are exact for this camera. `None` if even one point is too
/// many.
pub fn within_budget(
    block: &PointsBlock,
    camera: &Camera,
    ratio: f64,
    most: u64,
) -> Option<(Thresholds, u64)> {
    let triangles = block.triangles.len() as u64;
    if ratio.is_finite() && (1..=most).contains(&triangles) {
        // The source itself: nothing is better.
        return Some((Thresholds::TRIANGLES, triangles));
    }
    let mut cut = Cut::default();
    let mut count = |log: f64| {
        let finest = PixelArea(log.exp2());
        let largest = PixelArea(ratio * finest.0);
        let thresholds = Thresholds { finest, largest, depth_bias: PixelArea(0.0) };
        select_into(block, camera, &thresholds, &mut cut);
        (thresholds, cut.points(block).count() as u64 + cut.triangle_count())
    };
    // Bisection between a cut that fits and one that does not, in logarithms of s_m.
    let (mut low, mut high) = (-40.0, 60.0);
    let mut best = count(high);
    if best.1 > most {
        return None;
    }
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        let found = count(middle);
        if found.1 <= most {
            (high, best) = (middle, found);
        } else {
            low = middle;
        }
    }
    Some(best)
}

fn code(code: Option<SizeCode>) -> i32 {
    code.map_or(-1, |c| i32::from(c.bits()))
}

/// The prefix of points whose parent is too large.
fn exact_range(block: &PointsBlock, cell: &CellRecord, fine: i32) -> Range<u32> {
    let points = block.cell_points(cell);
    let end = points.partition_point(|p| i32::from(p.parent().bits()) > fine) as u32;
    cell.first_point..cell.first_point + end
}

/// The paper's plain range of own sizes.
fn paper_range(block: &PointsBlock, cell: &CellRecord, fine: i32, coarse: i32) -> Range<u32> {
    let points = block.cell_points(cell);
    let start = points.partition_point(|p| i32::from(p.own().bits()) > coarse) as u32;
    let end = points.partition_point(|p| i32::from(p.own().bits()) >= fine) as u32;
    cell.first_point + start..cell.first_point + end.max(start)
}

#[cfg(test)]
pub(crate) mod tests;
