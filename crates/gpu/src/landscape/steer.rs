//! Thresholds at run time: for a rate of pictures, or for an error.
//!
//! The thresholds of the points "allow the user to choose either a target quality or a target display
//! rate" (Gilet et al. 2005, section 6).

use crate::landscape::LandscapeDetail;
use forest_pack::kind;
use forest_pack::measures::{ErrorKind, Light, Measures, Need};
use forest_points::{PixelArea, Thresholds};

/// Steers s_m so that pictures take a given time.
///
/// Times follow s_m slowly and never rise with it, by a law that differs from view to view. Each picture
/// moves log s_m by a part of the logarithm of what is missing, at most by an octave; within a band about
/// the goal nothing moves, so that noise does not. With a part below 1 and times that fall no faster than
/// 1/s_m the distance to the goal shrinks with every picture, and its sign stays: nothing oscillates.
#[derive(Clone, Debug, PartialEq)]
pub struct Steering {
    goal_ms: f64,
    log_finest: f64,
    /// Smoothed logarithm of the time over the goal.
    behind: Option<f64>,
}

/// s_m is kept within these, in square pixels.
const FINEST: [f64; 2] = [0.5, 256.0];
/// Part of what is missing that a picture makes up for.
const PART: f64 = 0.5;
/// Logarithm of the band about the goal within which nothing moves.
const BAND: f64 = 0.1;
/// Weight of the newest picture in the smoothed time.
const NEWEST: f64 = 0.5;

impl Steering {
    /// For `rate` pictures a second, starting from `detail`.
    pub fn new(rate: f64, detail: &LandscapeDetail) -> Self {
        let start = detail.finest.0.clamp(FINEST[0], FINEST[1]);
        Self { goal_ms: 1e3 / rate, log_finest: start.ln(), behind: None }
    }

    /// Takes in what a picture took, and says how finely to draw the next one.
    pub fn next(&mut self, ms: f64, detail: &LandscapeDetail) -> LandscapeDetail {
        let now = (ms.max(1e-6) / self.goal_ms).ln();
        let behind = self.behind.map_or(now, |before| before + NEWEST * (now - before));
        self.behind = Some(behind);
        if behind.abs() > BAND {
            let limits = FINEST.map(f64::ln);
            let step = (PART * behind).clamp(-std::f64::consts::LN_2, std::f64::consts::LN_2);
            self.log_finest = (self.log_finest + step).clamp(limits[0], limits[1]);
            // What was seen so far belongs to the old threshold.
            self.behind = None;
        }
        let finest = self.log_finest.exp();
        LandscapeDetail {
            finest: PixelArea(finest),
            largest: PixelArea(finest * Thresholds::LARGEST_RATIO),
            ..*detail
        }
    }
}

/// Heights of trees in pixels that an error is looked up for.
const HEIGHTS: [f32; 5] = [16.0, 32.0, 64.0, 128.0, 256.0];

/// The largest s_m whose measured FLIP error is at most `error` in all views of all of these packs, at the
/// median of the heights that trees of a landscape have; `None` where nothing so good was measured.
pub fn finest_for<'m>(
    measures: impl Iterator<Item = &'m Measures>,
    error: f32,
) -> Option<PixelArea> {
    let of = |measures: &Measures| {
        let at = |pixel_height: f32| {
            let need = Need {
                representation: kind::POINTS_HEADER,
                pixel_height,
                elevation: None,
                light: Light::Albedo,
                error: ErrorKind::Flip,
            };
            measures.cheapest(&need, error).map(|c| c.level[0])
        };
        let mut found: Vec<f32> = HEIGHTS.iter().filter_map(|h| at(*h)).collect();
        found.sort_by(f32::total_cmp);
        found.get(found.len() / 2).copied()
    };
    let all: Option<Vec<f32>> = measures.map(of).collect();
    let least = all?.into_iter().fold(f32::INFINITY, f32::min);
    least.is_finite().then(|| PixelArea(f64::from(least).clamp(FINEST[0], FINEST[1])))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// s_m over 60 pictures that take `law(s_m)` ms, with a little noise.
    fn run(rate: f64, start: f64, law: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut detail = LandscapeDetail { finest: PixelArea(start), ..LandscapeDetail::default() };
        let mut steering = Steering::new(rate, &detail);
        let picture = |i: u32| {
            let noise = 1.0 + 0.04 * (f64::from(i) * 2.4).sin();
            detail = steering.next(law(detail.finest.0) * noise, &detail);
            detail.finest.0
        };
        (0..60).map(picture).collect()
    }

    #[test]
    fn the_rate_is_reached_without_oscillation() {
        // From far below and far above the goal, where time falls fast and slowly.
        for (fixed, power) in [(1.0, 1.0), (4.0, 0.7), (2.0, 0.3)] {
            for start in [0.5, 8.0, 200.0] {
                let law = |s: f64| fixed + 40.0 * s.powf(-power);
                let path = run(1e3 / 12.0, start, law);
                let last = law(path[59]);
                let reached = (last - 12.0).abs() < 0.15 * 12.0 || path[59] >= 250.0;
                assert!(reached, "{fixed} {power} {start}: {last}");
                // It comes from one side, and stays.
                let turns = path.windows(3).filter(|w| (w[1] - w[0]) * (w[2] - w[1]) < 0.0).count();
                assert!(turns <= 1, "{turns} turns: {path:?}");
                assert!(path[40..].windows(2).all(|w| w[0] == w[1]), "{path:?}");
            }
        }
    }

    #[test]
    fn what_cannot_be_reached_ends_at_the_limit() {
        assert!((run(1000.0, 1.0, |_| 50.0)[59] - 256.0).abs() < 1e-9);
        assert!((run(1.0, 4.0, |_| 50.0)[59] - 0.5).abs() < 1e-9);
    }

    #[test]
    fn an_error_is_looked_up_in_the_table() {
        use forest_pack::measures::Measure;
        let row = |s_m: f32, flip: f32| {
            HEIGHTS.map(|pixel_height| Measure {
                representation: kind::POINTS_HEADER,
                level: [s_m, 16.0 * s_m, 0.0],
                pixel_height,
                elevation: [-90.0, 90.0],
                light: Light::Albedo,
                primitives: 1000.0 / s_m,
                bytes: 1.0,
                rmse: 0.0,
                rmse_worst: 0.0,
                flip,
                flip_worst: flip,
                ssim: 1.0,
                coverage: 0.0,
            })
        };
        let rows = [row(1.0, 0.02), row(4.0, 0.05), row(16.0, 0.2)].concat();
        let measures = Measures { method: String::new(), rows };
        let finest = |e| finest_for([&measures].into_iter(), e).map(|a| a.0);
        assert_eq!((finest(0.1), finest(0.03), finest(0.01)), (Some(4.0), Some(1.0), None));
    }
}
