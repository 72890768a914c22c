//! How far a pack's levels are from their source, and what they cost.
//!
//! * **Metrics** ([`Comparison`], [`popping`]): RMSE, PSNR, SSIM, FLIP, coverage, silhouette, depth,
//!   over the box that holds what either picture shows. Each is tested against another
//!   implementation's values (`reference/metrics.py`).
//! * **Sweeps** ([`sweep()`]): the pack and other ways to draw the tree ([`Baselines`]), over pixel
//!   heights and held-out views, against the truth of [`forest_raster`]. One picture is drawn for
//!   each cut, at the largest height, and box-filtered to the others, as the truth is.
//! * **Ratios** ([`ratios`]): primitives at equal error, view by view.
//! * **Calibration** ([`calibrate()`]): factors on the areas of points, so that every cut covers what
//!   its source covers.
//! * **The measured table** ([`measures`]): what a pack carries to choose levels by.
//! * **Reports** ([`report`]): text, JSON ([`Evaluation`], a published schema), CSV, SVG, HTML.
//!
//! ```
//! use forest_eval::{Plan, Truth, own_contenders, sweep};
//! use forest_points::{BakeOptions, PointsBlock, bake};
//! use forest_raster::{Style, Surfaces};
//! use forest_soup::{Material, TriangleSoup};
//! use glam::Vec3;
//!
//! // A fan of 40 leaves.
//! let corner = |i: u32| Vec3::new((i as f32).cos(), i as f32 * 0.05, (i as f32).sin());
//! let fan = TriangleSoup {
//!     positions: (0..120).map(|i| if i % 3 == 0 { Vec3::Y } else { corner(i) }).collect(),
//!     triangles: (0..40).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
//!     triangle_materials: vec![0; 40],
//!     materials: vec![Material::default()],
//!     ..TriangleSoup::default()
//! };
//! let dir = tempfile::tempdir().unwrap();
//! let path = dir.path().join("fan.fpack");
//! let mut writer = forest_pack::PackWriter::create(&path).unwrap();
//! bake(&fan, &BakeOptions::default(), &mut writer, &|_| {}).unwrap();
//! writer.finish().unwrap();
//!
//! let pack = forest_pack::Pack::open(&path).unwrap();
//! let block = PointsBlock::open(&pack).unwrap();
//! let surfaces = Surfaces::new(&fan.materials, &fan.textures);
//! let truth = Truth::new(&fan, &surfaces, Style::default()).unwrap();
//! let plan = Plan { heights: vec![64, 16], views: 1, ..Plan::default() };
//! let found = sweep(&truth, &own_contenders(&block, None), &plan, &|_| {}).unwrap();
//! // The finest cut is nearest to the truth.
//! assert!(found.rows[0].errors.rmse < found.rows[4].errors.rmse);
//! ```

mod baselines;
mod calibrate;
mod contender;
mod embed;
mod error;
mod evaluation;
mod frame;
mod mattes;
mod metrics;
mod path;
mod plan;
mod ratio;
pub mod report;
mod sweep;
mod truth;

pub use baselines::{
    Baselines, foliage_contenders, own_contenders, views_contenders, volume_contenders,
};
pub use calibrate::{Calibrated, calibrate};
pub use contender::{Contender, Cost, Knob, ViewsLookup};
pub use embed::measures;
pub use error::EvalError;
pub use evaluation::{ContenderInfo, Evaluation, SCHEMA, Subject, Summary, json_schema, machine};
pub use frame::{Band, Frame, View, held_out_views};
pub use mattes::{MatteErrors, can_judge, drawn, hold_out, matte_errors};
pub use metrics::{Comparison, Errors, FlipMap, popping};
pub use path::PoppingRow;
pub use plan::{BACKGROUND, Plan};
pub use ratio::{Metric, Ratio, ratios};
pub use sweep::{Row, Sweep, pictures, sweep};
pub use truth::Truth;
