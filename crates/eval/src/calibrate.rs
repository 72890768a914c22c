//! Calibration: factors on the areas of points, so that every cut covers what the source covers.
//!
//! A cut for threshold s consists of points a little smaller than s, so that the factor of a size is
//! found from the coverage of the cut at that threshold. Coverage grows less than areas do, because
//! points hide each other: the exponent is learned from step to step.

use crate::error::EvalError;
use crate::frame::{View, views_from};
use crate::truth::Truth;
use forest_draw::draw_points;
use forest_points::{Calibration, PixelArea, PointsBlock, SizeCode, Thresholds};
use forest_raster::{Light, Sampling, Style};

/// Pixels of the tree's height in the pictures that coverage is measured in.
const HEIGHT: f64 = 256.0;
/// Views: others than those of a sweep.
const VIEWS: u32 = 6;
/// Rounds of measuring and correcting.
const ROUNDS: u32 = 4;
/// Coverage within this is not corrected any more.
const GOOD: f64 = 0.004;
/// Thresholds in square pixels: this one and every fourfold of it.
const FIRST: f64 = 1.0;
const CUTS: usize = 9;
/// Factors on areas stay within these.
const LEAST: f64 = 0.25;
const MOST: f64 = 4.0;

/// Means over whole pictures need few samples a pixel.
const STYLE: Style = Style { sampling: Sampling { side: 4, seed: 2 }, light: Light::Albedo };

/// What a calibration found.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibrated {
    /// The factors.
    pub calibration: Calibration,
    /// Coverage over the source's, minus one, without them: for each threshold, finest first.
    pub before: Vec<f64>,
}

/// Measures the factors of `block`'s points against `truth`. `progress` is told what share is done.
///
/// # Errors
/// When the source cannot be seen at all from some side.
pub fn calibrate(
    truth: &Truth,
    block: &PointsBlock,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Calibrated, EvalError> {
    let views = views_from(VIEWS, 0.25, 4.321);
    let side = truth.frame.side(HEIGHT, 1);
    let mut covered = Vec::new();
    for view in &views {
        covered.push(truth.picture(view, HEIGHT, side).mean_coverage());
    }
    if let Some(i) = covered.iter().position(|c| *c == 0.0) {
        return Err(EvalError::Unseen { elevation: views[i].elevation });
    }
    let mut block = block.clone();
    let codes = cut_codes(truth, &block);
    let mut cuts = [Cut::default(); CUTS];
    let mut before = Vec::new();
    let mut best: Option<(f64, Calibration)> = None;
    for round in 0..ROUNDS {
        let calibration = spread(&codes, &cuts);
        block.calibration = Some(calibration.clone());
        for (i, cut) in cuts.iter_mut().enumerate() {
            cut.learn(coverage_error(truth, &block, &views, &covered, i, side), round);
            progress((f64::from(round) + i as f64 / CUTS as f64) / f64::from(ROUNDS));
        }
        if round == 0 {
            before = cuts.iter().map(|c| c.error).collect();
        }
        // The best of what was measured is taken, not the last correction.
        let worst = cuts.iter().fold(0.0, |w: f64, c| w.max(c.error.abs()));
        if best.as_ref().is_none_or(|b| worst < b.0) {
            best = Some((worst, calibration));
        }
        if worst <= GOOD {
            break;
        }
        cuts.iter_mut().for_each(Cut::correct);
    }
    progress(1.0);
    let (_, calibration) = best.expect("at least one round");
    Ok(Calibrated { calibration, before })
}

/// What is known of one threshold's cut.
#[derive(Clone, Copy)]
struct Cut {
    /// Natural logarithm of the factor on areas, and by how much it was corrected last.
    log: f64,
    step: f64,
    /// Growth of the logarithm of coverage with it.
    slope: f64,
    /// Coverage over the source's, minus one, when last measured.
    error: f64,
}

impl Default for Cut {
    fn default() -> Self {
        Self { log: 0.0, step: 0.0, slope: 0.5, error: 0.0 }
    }
}

impl Cut {
    /// Takes a measured error, and learns from what the last correction did.
    fn learn(&mut self, error: f64, round: u32) {
        if round > 0 && self.step.abs() > 1e-3 {
            let change = log_coverage(error) - log_coverage(self.error);
            self.slope = (change / self.step).clamp(0.15, 1.2);
        }
        self.error = error;
    }

    fn correct(&mut self) {
        let log = self.log - log_coverage(self.error) / self.slope;
        let log = log.clamp(LEAST.ln(), MOST.ln());
        self.step = log - self.log;
        self.log = log;
    }
}

/// Logarithm of coverage over the source's; a cut may cover nothing.
fn log_coverage(error: f64) -> f64 {
    (1.0 + error).max(1e-3).ln()
}

/// Size codes of the thresholds, fractional.
fn cut_codes(truth: &Truth, block: &PointsBlock) -> Vec<f64> {
    let pixels = HEIGHT / truth.frame.height * block.scale();
    (0..CUTS)
        .map(|i| {
            let area = threshold(i) / (pixels * pixels);
            // Points of a cut lie below its threshold and above a half of it, most of them.
            f64::from(SizeCode::at_least(area / 1.4).bits())
        })
        .collect()
}

fn threshold(i: usize) -> f64 {
    FIRST * 4f64.powi(i as i32)
}

/// Factors of all octaves from those of the cuts: linear in the logarithm, constant outside.
fn spread(codes: &[f64], cuts: &[Cut]) -> Calibration {
    Calibration::new(std::array::from_fn(|node| {
        let code = node as f64 * SizeCode::PER_OCTAVE;
        let i = codes.partition_point(|c| *c <= code);
        let log = match i {
            0 => cuts[0].log,
            i if i == codes.len() => cuts[i - 1].log,
            i => {
                let t = (code - codes[i - 1]) / (codes[i] - codes[i - 1]).max(1.0);
                cuts[i - 1].log + (cuts[i].log - cuts[i - 1].log) * t.clamp(0.0, 1.0)
            }
        };
        log.exp() as f32
    }))
}

/// Coverage of cut `i` over the source's, minus one, over all views together.
fn coverage_error(
    truth: &Truth,
    block: &PointsBlock,
    views: &[View],
    covered: &[f64],
    i: usize,
    side: u32,
) -> f64 {
    let thresholds = Thresholds {
        finest: PixelArea(threshold(i)),
        largest: PixelArea(f64::INFINITY),
        depth_bias: PixelArea(0.0),
    };
    let sum: f64 = views
        .iter()
        .map(|view| {
            let camera = truth.frame.camera(view, HEIGHT, side);
            let (picture, _) = draw_points(block, None, &camera, &thresholds, STYLE);
            picture.mean_coverage()
        })
        .sum();
    sum / covered.iter().sum::<f64>() - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corrections_converge_on_any_slope() {
        for slope in [0.2, 0.5, 1.0] {
            // Coverage 1.3 times the source's, growing with areas to the power of `slope`.
            let mut cut = Cut::default();
            for round in 0..ROUNDS {
                cut.learn(1.3 * (slope * cut.log).exp() - 1.0, round);
                cut.correct();
            }
            let error = 1.3 * (slope * cut.log).exp() - 1.0;
            assert!(error.abs() < GOOD || cut.log == LEAST.ln(), "{slope}: {error}");
        }
        // What covers nothing grows as far as it may, and stays a number.
        let mut cut = Cut::default();
        cut.learn(-1.0, 0);
        cut.correct();
        assert_eq!(cut.log, MOST.ln());
    }

    #[test]
    fn factors_pass_through_those_of_the_cuts() {
        let codes = [800.0, 960.0, 1120.0];
        let cut = |log: f64| Cut { log, ..Cut::default() };
        let c = spread(&codes, &[cut(0.0), cut(2f64.ln()), cut(0.5f64.ln())]);
        let at = |node: usize| f64::from(c.factors()[node]);
        assert!((at(0) - 1.0).abs() < 1e-6 && (at(10) - 1.0).abs() < 1e-6);
        assert!((at(12) - 2.0).abs() < 1e-6 && (at(14) - 0.5).abs() < 1e-6);
        assert!((at(11) - 2f64.sqrt()).abs() < 1e-6 && (at(50) - 0.5).abs() < 1e-6);
    }
}
