//! eval

mod baselines;
mod calibrate;
mod contender;
mod embed;
mod error;
mod evaluation;
mod frame;
mod metrics;
mod ratio;
pub mod report;
mod sweep;

pub use baselines::{Baselines, own_contenders};
pub use calibrate::{Calibrated, calibrate};
pub use contender::{Contender, Cost, Knob};
pub use embed::measures;
pub use error::EvalError;
pub use evaluation::{ContenderInfo, Evaluation, SCHEMA, Subject, Summary, json_schema, machine};
pub use frame::{Band, Frame, View, held_out_views};
pub use metrics::{Comparison, Errors, FlipMap, popping};
pub use ratio::{Metric, Ratio, ratios};
pub use sweep::{BACKGROUND, Plan, PoppingRow, Row, Sweep, Truth, pictures, sweep};
