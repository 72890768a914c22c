//! Popping: contenders along a camera's path.

use crate::contender::{Contender, Knob};
use crate::frame::View;
use crate::metrics::popping;
use crate::plan::Plan;
use crate::truth::Truth;
use forest_raster::{Picture, Style};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Popping of a contender along a path.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PoppingRow {
    /// Name of the contender.
    pub contender: String,
    /// Height of the tree at the start of the path, in pixels.
    pub height: u32,
    /// Setting of its knob.
    pub knob: Knob,
    /// While the camera moves away: mean over the steps of what the picture changes and the truth
    /// does not ([`popping`]).
    pub moving: f64,
    /// The largest of a step.
    pub moving_worst: f64,
    /// The same with one cut for all steps: what is not due to switches of level. Null for meshes,
    /// whose level is the same for all steps anyway.
    pub moving_fixed: Option<f64>,
    /// Mean change of the truth itself.
    pub truth: f64,
    /// While only the level follows the steps and the camera stands still: mean change of the
    /// picture. A ladder of meshes takes one switch to the next level instead.
    pub still: f64,
    /// The largest of a step.
    pub still_worst: f64,
    /// While the camera goes around the tree, a degree a step: mean over the steps of what the
    /// picture changes and the truth does not.
    pub turning: f64,
    /// The largest of a step.
    pub turning_worst: f64,
    /// Mean change of the truth itself on the way around.
    pub turning_truth: f64,
}

/// Height at which the popping test starts; each step moves away by a hundredth.
const PATH_HEIGHT: u32 = 96;
const STEP: f64 = 1.01;

/// Degrees that the camera turns in a step.
const TURN: f64 = 1.0;

/// Popping of all contenders on the way from [`PATH_HEIGHT`], in one view.
pub(crate) fn paths(
    truth: &Truth,
    contenders: &[Contender],
    plan: &Plan,
    style: &Style,
    view: &View,
) -> Vec<PoppingRow> {
    let side = truth.frame.side(f64::from(PATH_HEIGHT), 1);
    let heights: Vec<f64> =
        (0..=plan.steps).map(|i| f64::from(PATH_HEIGHT) / STEP.powi(i as i32)).collect();
    let truths: Vec<Picture> = heights.iter().map(|&h| truth.picture(view, h, side)).collect();
    let still_truth = [&truths[0], &truths[0]];
    let (own, _) = changes(&truths, |_| still_truth);
    let around: Vec<View> = (0..=plan.steps).map(|i| view.turned(f64::from(i) * TURN)).collect();
    let start = heights[0];
    let turned: Vec<Picture> = around.iter().map(|v| truth.picture(v, start, side)).collect();
    let (turning_truth, _) = changes(&turned, |_| [&turned[0], &turned[0]]);
    let mut rows = Vec::new();
    for c in contenders {
        // The thresholds that most pictures are seen at: one to a few pixels.
        let knobs = c.knobs(&plan.s_m, &plan.shares);
        let Some((first, knob)) = knobs.iter().copied().enumerate().take(2).next_back() else {
            continue;
        };
        let draw = |h: f64, knob: Knob| c.draw(&truth.frame.camera(view, h, side), knob, style).0;
        let step = |i: usize| [&truths[i], &truths[i + 1]];
        let moving: Vec<Picture> = heights.iter().map(|&h| draw(h, knob)).collect();
        // The knob that means the first picture's cut from each place of the path.
        let same = |h: &f64| draw(*h, knob.nearer(h / heights[0]));
        let fixed = matches!(knob, Knob::Points { .. })
            .then(|| changes(&heights.iter().map(same).collect::<Vec<_>>(), step).0);
        let follow: Vec<Knob> = match knob {
            Knob::Points { .. } => heights.iter().map(|h| knob.nearer(heights[0] / h)).collect(),
            _ => knobs[first..].iter().take(2).copied().collect(),
        };
        let still: Vec<Picture> = follow.into_iter().map(|k| draw(heights[0], k)).collect();
        let (moving, moving_worst) = changes(&moving, step);
        let draw_turned = |v: &View| c.draw(&truth.frame.camera(v, start, side), knob, style).0;
        let turning: Vec<Picture> = around.iter().map(draw_turned).collect();
        let (turning, turning_worst) = changes(&turning, |i: usize| [&turned[i], &turned[i + 1]]);
        let (still, still_worst) = changes(&still, |_| still_truth);
        rows.push(PoppingRow {
            contender: c.name.into(),
            height: PATH_HEIGHT,
            knob,
            moving,
            moving_worst,
            moving_fixed: fixed,
            truth: own,
            still,
            still_worst,
            turning,
            turning_worst,
            turning_truth,
        });
    }
    rows
}

/// Mean and largest popping over the steps of `pictures`; 0 for a single picture.
fn changes<'a>(
    pictures: &[Picture],
    truth: impl Fn(usize) -> [&'a Picture; 2] + Sync,
) -> (f64, f64) {
    let steps: Vec<f64> = pictures
        .par_windows(2)
        .enumerate()
        .map(|(i, pair)| popping(truth(i), [&pair[0], &pair[1]]))
        .collect();
    let mean = steps.iter().fold(0.0, |a, b| a + b) / steps.len().max(1) as f64;
    (mean, steps.iter().copied().fold(0.0, f64::max))
}
