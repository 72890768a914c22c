//! What a bake can be told.

use serde::{Deserialize, Serialize};

/// How a cluster's point gets its radius and opacity from its children.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum RadiusRule {
    /// Ours: the radius follows the cluster's spread; the opacity keeps the mean projected area of
    /// the *union* of its surfels, so that leaves hiding each other are not counted twice.
    #[default]
    Opacity,
    /// As `Opacity`, but the *sum* of the surfels' projected areas is kept.
    Area,
    /// Gilet, Meyer, Neyret 2005, section 4.2: opaque spheres and the averaged radius. For two
    /// equal children at 60° it keeps 46 % of their area, and it is kept for comparison.
    Paper,
}

/// How the points of a cell are sorted and which of them a threshold draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Order {
    /// Ours, after Dachsbacher et al. 2003: by the parent's size, descending. The cut for any
    /// threshold is a filtered prefix, and represents every source triangle exactly once.
    #[default]
    Exact,
    /// Gilet, Meyer, Neyret 2005, section 4.3: by the point's own size; a cut is a plain range. It
    /// can draw a parent with its child, and leave holes.
    Paper,
}

/// How large the finest points may be.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum SurfelSize {
    /// From the block's shape: 1/256 of its height (at least 1/4096 of its diagonal).
    #[default]
    Auto,
    /// One surfel for each triangle, however large.
    Triangle,
    /// World units; no smaller than 2⁻¹⁶ of the block's radius.
    Units(f64),
}

/// How space is cut into cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GridChoice {
    /// At most this many cells, as near to cubes as they come: 64 for a tree, 1,024 for a group
    /// (the paper's 4×4×4 and 4×16×16).
    Budget(u32),
    /// Exactly this many along x, y (up) and z.
    Fixed([u32; 3]),
}

impl GridChoice {
    /// The paper's budget for one tree.
    pub const TREE: Self = Self::Budget(64);
    /// The paper's budget for a group of trees.
    pub const GROUP: Self = Self::Budget(1024);
}

/// Options of a bake.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BakeOptions {
    /// The grid.
    pub grid: GridChoice,
    /// The finest points.
    pub surfel_size: SurfelSize,
    /// A triangle with a translucent texture is cut until the part of its footprint that its
    /// surfels get wrong, `Σ 2·α·(1 − α) / Σ α` over equal pieces of mean coverage α, is at most
    /// this; or until the pieces are as small as the surfel size.
    pub alpha_tolerance: f64,
    /// Radius and opacity of clusters.
    pub radius: RadiusRule,
    /// Order of the arrays.
    pub order: Order,
    /// Write the triangles, materials and textures too.
    pub triangles: bool,
}

impl Default for BakeOptions {
    fn default() -> Self {
        Self {
            grid: GridChoice::TREE,
            surfel_size: SurfelSize::Auto,
            alpha_tolerance: 0.1,
            radius: RadiusRule::default(),
            order: Order::default(),
            triangles: true,
        }
    }
}
