//! Which level of which representation to draw: by the measured table in the pack, and by what levels
//! cost on this device.

use crate::costs::Costs;
use crate::frame::{Layer, What};
use crate::model::Model;
use forest_pack::measures::{Choice, ErrorKind};
use forest_points::Thresholds;
use forest_soup::Camera;
use forest_views::{Lookup, ViewsBlock};
use forest_volume::{Blending, Detail};

/// What a level is chosen for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// The cheapest level whose FLIP error is at most this in all measured views; the best one if there
    /// is none.
    Error(f32),
    /// The best level that so many pictures a second leave time for; the cheapest one if there is none.
    Rate(f64),
}

/// A mean FLIP error at which a tree and its level can hardly be told apart side by side: what is
/// asked for if nothing else is. (Our choice by eye, on the sample trees; FLIP itself names no limit.)
pub const JUST_NOTICEABLE: f32 = 0.05;

/// A level that may be drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// The level.
    pub what: What,
    /// What the table promises of it.
    pub choice: Choice,
    /// Milliseconds that it is expected to take.
    pub milliseconds: f64,
}

/// All levels of a model that were measured for a tree as large as `camera` sees it.
pub fn candidates(model: &Model, camera: &Camera, costs: &Costs) -> Vec<Candidate> {
    let Some(table) = model.measures() else { return Vec::new() };
    let error = ErrorKind::Flip;
    let needs = [
        model.foliage().map(|b| b.need(camera, error)),
        model.points().map(|b| b.need(camera, error)),
        model.views().map(|b| b.need(camera, error)),
        model.volume().map(|b| b.need(camera, error)),
    ];
    let representations: [fn(&Model, &Choice) -> Option<What>; 4] = [
        |_, c| Some(What::Foliage(c.level[0] as usize)),
        |_, c| Some(What::Points(Thresholds::of_level(c.level))),
        |model, c| views_level(model.views()?, c.level),
        |_, c| Some(What::Volume(Detail::Level(c.level[0] as u32), Blending::Shares)),
    ];
    let mut all = Vec::new();
    for (need, what) in needs.iter().zip(representations) {
        for choice in need.iter().flat_map(|n| table.choices(n)) {
            let Some(what) = what(model, &choice) else { continue };
            let milliseconds = costs.of(model, camera, &what, f64::from(choice.primitives));
            all.push(Candidate { what, choice, milliseconds });
        }
    }
    all
}

/// The views that a measured row is about.
fn views_level(block: &ViewsBlock, [texels, lookup, _]: [f32; 3]) -> Option<What> {
    let level = block.header.levels.iter().position(|l| l.texels as f32 == texels)?;
    let lookup = Lookup::ALL.get(lookup as usize)?;
    Some(What::Views(level, *lookup))
}

/// Expected times closer than this are taken for equal, and what is drawn already is kept.
const SLACK: f64 = 1.25;

impl Goal {
    /// The best of `candidates`; `now` is kept while it meets the goal and costs little more than the
    /// cheapest, so that choices do not flicker.
    pub fn choose(&self, candidates: &[Candidate], now: Option<&What>) -> Option<Candidate> {
        let by_cost = |a: &&Candidate, b: &&Candidate| {
            a.milliseconds.total_cmp(&b.milliseconds).then(by_error_only(a, b))
        };
        let by_error = |a: &&Candidate, b: &&Candidate| {
            by_error_only(a, b).then(a.milliseconds.total_cmp(&b.milliseconds))
        };
        let meets = |c: &&Candidate| match *self {
            Goal::Error(limit) => c.choice.error <= limit,
            Goal::Rate(rate) => c.milliseconds <= 1e3 / rate,
        };
        let good = candidates.iter().filter(meets);
        let best = match self {
            Goal::Error(_) => {
                good.clone().min_by(by_cost).or_else(|| candidates.iter().min_by(by_error))
            }
            Goal::Rate(_) => {
                good.clone().min_by(by_error).or_else(|| candidates.iter().min_by(by_cost))
            }
        }?;
        let kept = good.into_iter().find(|c| Some(&c.what) == now).filter(|c| match self {
            Goal::Error(_) => c.milliseconds <= best.milliseconds * SLACK,
            Goal::Rate(_) => c.choice.error <= best.choice.error * SLACK as f32,
        });
        Some(*kept.unwrap_or(best))
    }
}

fn by_error_only(a: &Candidate, b: &Candidate) -> std::cmp::Ordering {
    a.choice.error.total_cmp(&b.choice.error)
}

/// Fades from level to level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fader {
    now: What,
    /// What is being left, and the share of the samples that shows the new level already.
    before: Option<(What, f32)>,
    seconds: f32,
}

impl Fader {
    /// Shows `what` at once; changes take this long.
    pub fn new(what: What, seconds: f32) -> Self {
        Self { now: what, before: None, seconds }
    }

    /// What is shown, or faded to.
    pub fn now(&self) -> &What {
        &self.now
    }

    /// Goes on for `passed` seconds towards `wanted`. A fade that has begun is finished first.
    pub fn advance(&mut self, wanted: What, passed: f32) {
        if let Some((_, share)) = &mut self.before {
            *share += passed / self.seconds.max(f32::MIN_POSITIVE);
            if *share >= 1.0 {
                self.before = None;
            }
        }
        if self.before.is_none() && self.now != wanted {
            if self.seconds > 0.0 {
                self.before = Some((self.now, 0.0));
            }
            self.now = wanted;
        }
    }

    /// Whether two levels are shown.
    pub fn is_fading(&self) -> bool {
        self.before.is_some()
    }

    /// The layers to draw: one, or two on complementary samples.
    pub fn layers(&self) -> ([Layer; 2], usize) {
        match self.before {
            None => ([Layer::whole(self.now); 2], 1),
            Some((before, share)) => {
                let new = Layer { what: self.now, fade: [0.0, share] };
                ([new, Layer { what: before, fade: [share, 1.0] }], 2)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use forest_points::PixelArea;

    fn candidate(level: u32, error: f32, milliseconds: f64) -> Candidate {
        let what = What::Volume(Detail::Level(level), Blending::Shares);
        let choice =
            Choice { level: [level as f32, 0.0, 0.0], primitives: 1.0, error, beyond: false };
        Candidate { what, choice, milliseconds }
    }

    #[test]
    fn goals_choose_by_error_or_time() {
        let all = [candidate(7, 0.02, 20.0), candidate(6, 0.04, 9.0), candidate(5, 0.045, 8.0)];
        let chosen = |goal: Goal, now: Option<usize>| {
            goal.choose(&all, now.map(|i| &all[i].what)).unwrap().milliseconds
        };
        assert_eq!(chosen(Goal::Error(0.05), None), 8.0);
        // 9 ms is near enough to 8 for what is drawn already, 20 is not.
        assert_eq!(chosen(Goal::Error(0.05), Some(1)), 9.0);
        assert_eq!(chosen(Goal::Error(0.05), Some(0)), 8.0);
        assert_eq!(chosen(Goal::Error(0.042), Some(2)), 9.0);
        assert_eq!(chosen(Goal::Error(0.001), None), 20.0);
        assert_eq!(chosen(Goal::Rate(100.0), None), 9.0);
        assert_eq!(chosen(Goal::Rate(20.0), None), 20.0);
        assert_eq!(chosen(Goal::Rate(1000.0), None), 8.0);
        assert_eq!(Goal::Error(1.0).choose(&[], None), None);
    }

    #[test]
    fn fades_share_the_samples_and_end() {
        let [a, b] = [1.0, 4.0]
            .map(|s| What::Points(Thresholds { finest: PixelArea(s), ..Thresholds::default() }));
        let mut fader = Fader::new(a, 0.5);
        assert_eq!(fader.layers().1, 1);
        fader.advance(b, 0.1);
        fader.advance(b, 0.125);
        let ([new, old], 2) = fader.layers() else { panic!("{fader:?}") };
        assert_eq!((new.what, new.fade), (b, [0.0, 0.25]));
        assert_eq!((old.what, old.fade), (a, [0.25, 1.0]));
        // A change of mind waits for its turn.
        fader.advance(a, 0.25);
        assert_eq!(*fader.now(), b);
        fader.advance(a, 0.25);
        assert_eq!((*fader.now(), fader.is_fading()), (a, true));
    }
}
