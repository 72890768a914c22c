//! Points: a tree as a continuous level of detail.
//!
//! System *points*, after G. Gilet, A. Meyer, F. Neyret, "Point-based rendering of trees",
//! Eurographics Workshop on Natural Phenomena 2005: triangles become surfels (section 4.1), cells
//! of a regular grid cluster theirs into binary trees (4.2), and every cell stores its points
//! sorted by size (4.3), so that a threshold selects a level (5.1, 5.2). Where we deviate:
//!
//! * a point is an oblate spheroid with an opacity ([`spheroid`]), not an opaque sphere: it keeps
//!   projected area and opacity over the levels (the authors' future work);
//! * arrays are sorted by the *parent's* size, as in C. Dachsbacher, C. Vogelgsang,
//!   M. Stamminger, "Sequential point trees", SIGGRAPH 2003, which makes cuts exact;
//! * textured cards are cut until their surfels follow the alpha footprint;
//! * a tree above the cells brings a far block down to one point.
//!
//! The paper's radius and order remain as [`RadiusRule::Paper`] and [`Order::Paper`].
//!
//! Two faces: [`bake()`] writes the sections of a pack; [`PointsBlock`] reads them, and
//! [`select()`] says what to draw of them for a camera.
//!
//! ```
//! use forest_points::{BakeOptions, PointsBlock, Thresholds, bake, select};
//! use forest_soup::{Camera, Material, Projection, TriangleSoup};
//! use glam::{DVec3, Vec3};
//!
//! // A strip of 100 triangles.
//! let soup = TriangleSoup {
//!     positions: (0..102).map(|i| Vec3::new(i as f32 * 0.1, (i % 2) as f32, 0.0)).collect(),
//!     triangles: (0..100).map(|i| [i, i + 1, i + 2]).collect(),
//!     triangle_materials: vec![0; 100],
//!     materials: vec![Material::default()],
//!     ..TriangleSoup::default()
//! };
//! let dir = tempfile::tempdir().unwrap();
//! let path = dir.path().join("strip.fpack");
//! let mut writer = forest_pack::PackWriter::create(&path).unwrap();
//! bake(&soup, &BakeOptions::default(), &mut writer, &|_| {}).unwrap();
//! writer.finish().unwrap();
//!
//! let pack = forest_pack::Pack::open(&path).unwrap();
//! let block = PointsBlock::open(&pack).unwrap();
//! let projection = Projection::Perspective { fov_y: 1.0 };
//! let far = Camera::new(DVec3::new(5.0, 0.0, 1e5), -DVec3::Z, projection, [640, 480]);
//! let cut = select(&block, &far, &Thresholds::default());
//! assert_eq!(cut.points(&block).count(), 1); // far away, the strip is one point
//! ```

mod bake;
mod block;
mod calibration;
mod header;
mod materials;
mod open;
mod options;
mod pruned;
pub mod record;
mod select;
mod size;
pub mod spheroid;
mod triangle;
mod validate;

pub use bake::audit::{CutAudit, audit};
pub use bake::timing::{StageTimes, Stopwatch};
pub use bake::{BakeError, BakeReport, bake, bake_model};
pub use block::PointsBlock;
pub use calibration::Calibration;
pub use header::{BakeCounts, CellRecord, PointsHeader};
pub use materials::{read_materials, write_materials};
pub use options::{BakeOptions, GridChoice, Order, RadiusRule, SurfelSize};
pub use pruned::{PointsNeed, PruneReport, Pruned, prune, pruned_bytes};
pub use record::PointRecord;
pub use select::{CellCut, Cut, PixelArea, Thresholds, select, select_into, within_budget};
pub use size::SizeCode;
pub use triangle::{TriangleRecord, UvRange, VertexRecord};
pub use validate::validate;
