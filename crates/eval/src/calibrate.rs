//! Calibration: factors on the areas of points, so that every cut covers what the source covers.
//!
//! A cut for threshold s consists of points a little smaller than s, so that the factor of a size is
//! found from the coverage of the cut at that threshold. Coverage grows less than areas do, because
//! points hide each other: the exponent is learned from step to step.

use crate::error::EvalError;
use crate::frame::{View, views_from};
use crate::sweep::Truth;
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
const GOOD: f64 = 0.002;
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
    if covered.contains(&0.0) {
        return Err(EvalError::NothingToSee);
    }
    let mut block = block.clone();
    let codes = cut_codes(truth, &block);
    let mut cuts = [Cut { log: 0.0, slope: 0.5, error: f64::INFINITY }; CUTS];
    let (mut before, mut done) = (Vec::new(), 0.0);
    for round in 0..ROUNDS {
        block.calibration = Some(spread(&codes, &cuts));
        for (i, cut) in cuts.iter_mut().enumerate().filter(|c| c.1.error.abs() > GOOD) {
            let error = coverage_error(truth, &block, &views, &covered, i, side);
            cut.learn(error, round);
            done += 1.0 / (CUTS as f64 * f64::from(ROUNDS));
            progress(done);
        }
        if round == 0 {
            before = cuts.iter().map(|c| c.error).collect();
        }
        if cuts.iter().all(|c| c.error.abs() <= GOOD) {
            break;
        }
        cuts.iter_mut().filter(|c| c.error.abs() > GOOD).for_each(Cut::correct);
    }
    progress(1.0);
    Ok(Calibrated { calibration: spread(&codes, &cuts), before })
}

/// What is known of one threshold's cut.
#[derive(Clone, Copy)]
struct Cut {
    /// Natural logarithm of the factor on areas.
    log: f64,
    /// Growth of the logarithm of coverage with it.
    slope: f64,
    /// Coverage over the source's, minus one, when last measured.
    error: f64,
}

impl Cut {
    /// Takes a measured error, and learns how far the last correction went.
    fn learn(&mut self, error: f64, round: u32) {
        if round > 0 {
            let step = -(1.0 + self.error).ln() / self.slope;
            let change = (1.0 + error).ln() - (1.0 + self.error).ln();
            self.slope = (change / step).clamp(0.15, 1.2);
        }
        self.error = error;
    }

    fn correct(&mut self) {
        let log = self.log - (1.0 + self.error).ln() / self.slope;
        self.log = log.clamp(LEAST.ln(), MOST.ln());
    }
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
            let (picture, _) = draw_points(block, None, &camera, &thresholds, &STYLE);
            picture.mean_coverage()
        })
        .sum();
    sum / covered.iter().sum::<f64>() - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_pass_through_those_of_the_cuts() {
        let codes = [800.0, 960.0, 1120.0];
        let cut = |log: f64| Cut { log, slope: 0.5, error: 0.0 };
        let c = spread(&codes, &[cut(0.0), cut(2f64.ln()), cut(0.5f64.ln())]);
        let at = |node: usize| f64::from(c.factors()[node]);
        assert!((at(0) - 1.0).abs() < 1e-6 && (at(10) - 1.0).abs() < 1e-6);
        assert!((at(12) - 2.0).abs() < 1e-6 && (at(14) - 0.5).abs() < 1e-6);
        assert!((at(11) - 2f64.sqrt()).abs() < 1e-6 && (at(50) - 0.5).abs() < 1e-6);
    }
}
