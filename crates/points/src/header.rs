//! The header and the cell table of the points representation.

use crate::options::{Order, RadiusRule};
use crate::triangle::UvRange;
use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

/// Section `points.header`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointsHeader {
    /// World position of the block's centre.
    pub origin: [f64; 3],
    /// World units in a block unit: 2^exponent. The block lies in the unit ball of block space.
    pub exponent: i32,
    /// Block units in a position step: 2^step_exponent.
    pub step_exponent: i32,
    /// Smallest corner of the source's box, in block units.
    pub min: [f64; 3],
    /// Largest corner of the source's box, in block units.
    pub max: [f64; 3],
    /// Cells along x, y and z.
    pub grid: [u32; 3],
    /// Order of the arrays.
    pub order: Order,
    /// Rule of radii and opacities.
    pub radius: RadiusRule,
    /// Surfel size in block units; infinite for one surfel a triangle.
    pub surfel_size: f64,
    /// Tolerance of the alpha footprint.
    pub alpha_tolerance: f64,
    /// What was counted while baking.
    pub counts: BakeCounts,
    /// Texture coordinate ranges of the triangle records, one for each material; empty if the pack
    /// has no triangles.
    pub uv_ranges: Vec<UvRange>,
}

/// What became of the source's triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BakeCounts {
    /// Triangles in the source.
    pub source_triangles: u64,
    /// Left out: a corner is NaN or infinite.
    pub non_finite: u64,
    /// Left out: no area (less than 2⁻⁵² of a squared block unit).
    pub zero_area: u64,
    /// Left out: the same corners and material as an earlier triangle.
    pub duplicate: u64,
    /// Left out: its texture shows nothing there.
    pub transparent: u64,
    /// Points of the base set.
    pub surfels: u64,
    /// Points of all levels.
    pub points: u64,
}

impl std::fmt::Display for BakeCounts {
    /// "of 12 triangles, dropped: 3 without area".
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let dropped = self.dropped().unwrap_or_else(|| "none".into());
        write!(f, "of {} triangles, dropped: {dropped}", self.source_triangles)
    }
}

impl BakeCounts {
    /// Triangles that are represented.
    pub fn triangles(&self) -> u64 {
        self.source_triangles - self.non_finite - self.zero_area - self.duplicate - self.transparent
    }

    /// What was dropped and why, or `None` if nothing was.
    pub fn dropped(&self) -> Option<String> {
        let reasons = [
            (self.non_finite, "with NaN or infinite corners"),
            (self.zero_area, "without area"),
            (self.duplicate, "that repeat another"),
            (self.transparent, "that are fully transparent"),
        ];
        let named: Vec<String> =
            reasons.iter().filter(|r| r.0 > 0).map(|(n, why)| format!("{n} {why}")).collect();
        (!named.is_empty()).then(|| named.join(", "))
    }

    pub(crate) fn add(&mut self, o: &Self) {
        self.source_triangles += o.source_triangles;
        self.non_finite += o.non_finite;
        self.zero_area += o.zero_area;
        self.duplicate += o.duplicate;
        self.transparent += o.transparent;
        self.surfels += o.surfels;
        self.points += o.points;
    }
}

/// One row of section `points.cells`, 64 bytes. The cells tile the point and triangle arrays in
/// order; the last row is the block's own tree above the cells, with no triangles.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct CellRecord {
    /// Position of the cell's zero, in steps (not shifted) from the block's centre.
    pub origin: [i32; 3],
    /// First point.
    pub first_point: u32,
    /// Number of points.
    pub points: u32,
    /// First triangle.
    pub first_triangle: u32,
    /// Number of triangles.
    pub triangles: u32,
    /// Middle of the cell's content, in block units.
    pub center: [f32; 3],
    /// Radius of a sphere about `center` that holds the content.
    pub radius: f32,
    /// Size code of the parent of the cell's root, in the block's own tree.
    pub root_parent: u16,
    /// 1 for the block's own tree, else 0.
    pub top: u16,
    /// Number of the cell in the grid, (y·nz + z)·nx + x; 2³²−1 for the block's own tree.
    pub grid_index: u32,
    /// Points of the base set in the cell.
    pub surfels: u32,
    /// Positions count in steps of 2^this; 0 but for the block's own tree, which is wider.
    pub step_shift: u32,
    /// Zero.
    pub reserved: u32,
}

const _: () = assert!(size_of::<CellRecord>() == 64);

impl CellRecord {
    /// Whether this is the block's own tree.
    pub fn is_top(&self) -> bool {
        self.top != 0
    }
}
