//! Landscapes: many trees of a few packs, on a terrain.
//!
//! A frame is made in bands from near to far. In each a compute shader looks at all trees of the tiles
//! that are before the camera: those beside the picture, or behind what nearer bands drew, are left
//! out; far ones are drawn at once, or put down as one cell; of near ones another shader chooses the
//! cells, by the rule of `forest_points::select`. Points are splatted by an indirect dispatch, triangles
//! and large points drawn by indirect draws. The CPU sorts tiles of 128 trees, and chooses the patches
//! of the ground.

mod frame;
mod impostors;
mod model;
mod pass;
mod steer;
mod tables;
mod target;

pub use frame::{LandscapeDetail, LandscapeDrawn};
pub(crate) use impostors::{BUCKETS, BUCKETS_PER_OCTAVE, COMPASS};
pub use model::Landscape;
pub use pass::LandscapeRenderer;
pub use steer::{Steering, finest_for};
pub use target::LandscapeTarget;

/// Samples along a side of a block of the nearness pyramid.
pub(crate) const BLOCK: u32 = 4;

/// Samples along a side of the square that a probe stands for.
pub(crate) const PROBE: u32 = BLOCK / 2;

/// What is seen less of than this share is drawn no coarser.
pub(crate) const LEAST_SHARE: f64 = 1.0 / 16.0;

/// Places on the way to the eye that are asked for trees.
pub(crate) const VIEW_STEPS: u32 = 10;

/// Levels of the pyramid, and the probes.
pub(crate) const MOST_NEARNESS: usize = 8;

/// Bands of a frame.
pub(crate) const MOST_BANDS: usize = 8;

/// Corners of the triangles of a patch and its skirt.
pub(crate) const PATCH_VERTICES: u32 = 6 * (forest_scene::PATCH + 2) * (forest_scene::PATCH + 2);

/// Metres between gusts that travel over the land.
pub(crate) const GUST: f64 = 60.0;

/// Turns by which trees beside each other differ in their swing.
pub(crate) const OWN_PHASE: f64 = 0.25;

/// Triangles of a run: what an instance of an indirect draw draws.
pub(crate) const RUN_TRIANGLES: u32 = 64;
