//! The sweep: truth and contenders, view by view and height by height.

use crate::contender::{Contender, Cost, Knob};
use crate::error::EvalError;
use crate::frame::{Frame, View, held_out_views};
use crate::metrics::{Comparison, Errors, popping};
use forest_raster::{Light, Picture, RayScene, Sampling, Style, Surfaces, rasterize};
use forest_soup::TriangleSoup;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Linear grey behind pictures where a metric wants a background.
pub const BACKGROUND: f32 = 0.5;

/// What a sweep looks at.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Heights of the tree in pixels: the largest first, and divisors of it.
    pub heights: Vec<u32>,
    /// Held-out view directions.
    pub views: u32,
    /// Thresholds s_m in square pixels, > 0.
    pub s_m: Vec<f64>,
    /// Shares of primitives for contenders without thresholds, in `0..=1`.
    pub shares: Vec<f64>,
    /// Light, on truth and contenders. The truth's sun throws shadows, the contenders' does not.
    pub light: Light,
    /// Samples of a pixel, of truth and contenders.
    pub sampling: Sampling,
    /// Camera steps of the popping test; 0 leaves it out.
    pub steps: u32,
}

impl Default for Plan {
    /// Four views of 256 to 4 pixels: under two minutes for a tree of 200,000 triangles.
    fn default() -> Self {
        Self {
            heights: vec![256, 64, 16, 4],
            views: 4,
            s_m: vec![0.5, 2.0, 8.0, 32.0, 128.0],
            shares: vec![0.3, 0.1, 0.03, 0.01, 0.003, 0.001, 0.0001],
            light: Light::Albedo,
            sampling: Sampling::TRUTH,
            steps: 12,
        }
    }
}

impl Plan {
    /// Sixteen views of 1024 to 4 pixels, thresholds in steps of two.
    pub fn full() -> Self {
        Self {
            heights: (2..=10).rev().map(|p| 1 << p).collect(),
            views: 16,
            s_m: (-2..=8).map(f64::from).map(f64::exp2).collect(),
            ..Self::default()
        }
    }

    fn check(&self) -> Result<(), EvalError> {
        let fail = |option, value, rule| Err(EvalError::Plan { option, value, rule });
        if self.heights.is_empty() || self.heights.iter().any(|h| !(1..=8192).contains(h)) {
            return fail("--heights", format!("{:?}", self.heights), "numbers from 1 to 8192");
        }
        let largest = self.heights[0];
        if self.heights.iter().any(|h| !largest.is_multiple_of(*h)) {
            let rule = "the largest first, and divisors of it";
            return fail("--heights", format!("{:?}", self.heights), rule);
        }
        if self.views == 0 {
            return fail("--views", "0".into(), "at least 1");
        }
        if self.s_m.is_empty() || self.s_m.iter().any(|s| !(s.is_finite() && *s > 0.0)) {
            return fail("--s-m", format!("{:?}", self.s_m), "positive areas in square pixels");
        }
        Ok(())
    }
}

/// One picture's cost and errors. Depth errors are in half diagonals of the tree's box.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Row {
    /// Name of the contender.
    pub contender: String,
    /// Height of the tree in pixels.
    pub height: u32,
    /// Index of the view.
    pub view: u32,
    /// Setting of its knob.
    pub knob: Knob,
    /// What it cost.
    pub cost: Cost,
    /// How far it is from the truth.
    pub errors: Errors,
}

/// Popping of a contender along a path.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PoppingRow {
    /// Name of the contender.
    pub contender: String,
    /// Height of the tree at the start of the path, in pixels.
    pub height: u32,
    /// Setting of its knob.
    pub knob: Knob,
    /// While the camera moves away: mean over the steps of the change beyond the truth's own, as
    /// a root mean square.
    pub moving: f64,
    /// The largest of a step.
    pub moving_worst: f64,
    /// Mean change of the truth itself.
    pub truth: f64,
    /// While only the level follows the steps and the camera stands still: mean change of the
    /// picture. A ladder of meshes takes one switch to the next level instead.
    pub still: f64,
    /// The largest of a step.
    pub still_worst: f64,
}

/// What a sweep found.
#[derive(Clone, Debug, Default)]
pub struct Sweep {
    /// The views.
    pub views: Vec<View>,
    /// Every picture.
    pub rows: Vec<Row>,
    /// Every path.
    pub popping: Vec<PoppingRow>,
}

/// The tree's truth, ready to be drawn.
pub struct Truth<'a> {
    soup: &'a TriangleSoup,
    surfaces: &'a Surfaces,
    rays: Option<RayScene<'a>>,
    style: Style,
    /// Its place and size.
    pub frame: Frame,
}

impl<'a> Truth<'a> {
    /// Truth by scanlines; by rays where light throws shadows.
    ///
    /// # Errors
    /// When the soup is invalid or has no extent.
    pub fn new(
        soup: &'a TriangleSoup,
        surfaces: &'a Surfaces,
        style: Style,
    ) -> Result<Self, EvalError> {
        soup.validate()?;
        let frame = Frame::of(soup).ok_or(EvalError::NothingToSee)?;
        let rays = match style.light {
            Light::Albedo => None,
            Light::Sun(_) => Some(RayScene::new(soup, surfaces)),
        };
        Ok(Self { soup, surfaces, rays, style, frame })
    }

    /// The tree `height` pixels high from `view`, in a picture of `side` pixels.
    pub fn picture(&self, view: &View, height: f64, side: u32) -> Picture {
        let camera = self.frame.camera(view, height, side);
        match &self.rays {
            Some(rays) => rays.picture(&camera, &self.style),
            None => rasterize(self.soup, self.surfaces, &camera, &self.style),
        }
    }

    /// Side of the pictures of a sweep: they show the tree at `heights[0]`, and can be filtered to
    /// all others.
    fn side(&self, heights: &[u32]) -> u32 {
        let multiple = heights.iter().map(|h| heights[0] / h).fold(1, lcm);
        self.frame.side(f64::from(heights[0]), multiple)
    }
}

fn lcm(a: u32, b: u32) -> u32 {
    let gcd = |mut a: u32, mut b: u32| {
        while b != 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    a / gcd(a, b) * b
}

/// A picture to draw: a contender, its knob at the largest height, and for which heights that is a
/// setting of the sweep.
struct Job<'c, 'p> {
    contender: &'c Contender<'p>,
    knob: Knob,
    heights: Vec<(u32, Knob)>,
}

/// A knob means a cut, and a cut at one height is another knob's at another: each cut is drawn once.
fn jobs<'c, 'p>(plan: &Plan, contenders: &'c [Contender<'p>]) -> Vec<Job<'c, 'p>> {
    let mut jobs: Vec<Job> = Vec::new();
    for contender in contenders {
        let first = jobs.len();
        for &height in &plan.heights {
            for knob in contender.knobs(&plan.s_m, &plan.shares) {
                let drawn = knob.nearer(f64::from(plan.heights[0]) / f64::from(height));
                match jobs[first..].iter_mut().find(|j| j.knob == drawn) {
                    Some(job) => job.heights.push((height, knob)),
                    None => {
                        jobs.push(Job { contender, knob: drawn, heights: vec![(height, knob)] })
                    }
                }
            }
        }
    }
    jobs
}

/// Number of pictures that a sweep of `plan` draws.
pub fn pictures(plan: &Plan, contenders: &[Contender]) -> u64 {
    jobs(plan, contenders).len() as u64 * u64::from(plan.views)
}

/// Draws and judges everything; `progress` is told how many pictures are done.
///
/// Pictures are drawn at the largest height and box-filtered to the others, truth and contender
/// alike and from the same samples, so that a smaller picture has as many more samples a pixel.
/// Their times are measured at their own height, in the first view.
///
/// # Errors
/// When the plan makes no sense.
pub fn sweep(
    truth: &Truth,
    contenders: &[Contender],
    plan: &Plan,
    progress: &(dyn Fn(u64) + Sync),
) -> Result<Sweep, EvalError> {
    plan.check()?;
    let mut out = Sweep { views: held_out_views(plan.views), ..Sweep::default() };
    let style = Style { sampling: plan.sampling, light: plan.light };
    let jobs = jobs(plan, contenders);
    let (largest, side) = (plan.heights[0], truth.side(&plan.heights));
    let mut times: Vec<Vec<f64>> = Vec::new();
    let mut done = 0;
    for (v, view) in (0..).zip(&out.views) {
        let camera = truth.frame.camera(view, f64::from(largest), side);
        let whole = truth.picture(view, f64::from(largest), side);
        let truths: Vec<Picture> =
            plan.heights.par_iter().map(|h| whole.box_filtered(largest / h)).collect();
        // Drawn one by one, so that their times are their own, and judged together.
        for (b, batch) in (0..).zip(jobs.chunks(2 * rayon::current_num_threads())) {
            let mut tasks = Vec::new();
            for (j, job) in (b * 2 * rayon::current_num_threads()..).zip(batch) {
                let (picture, cost) = job.contender.draw(&camera, job.knob, &style);
                if v == 0 {
                    times.push(job.times(truth, view, &style, largest, cost.render_ms));
                }
                let picture = std::sync::Arc::new(picture);
                for (&(height, knob), &render_ms) in job.heights.iter().zip(&times[j]) {
                    let cost = Cost { render_ms, ..cost };
                    tasks.push((job.contender.name, height, knob, cost, picture.clone()));
                }
            }
            let rows = tasks.into_par_iter().map(|(name, height, knob, cost, picture)| {
                let at = plan.heights.iter().position(|h| *h == height).expect("a height");
                let errors = Comparison::new(&truths[at], &picture.box_filtered(largest / height))
                    .errors(BACKGROUND, truth.frame.radius);
                Row { contender: name.into(), height, view: v, knob, cost, errors }
            });
            out.rows.extend(rows.collect::<Vec<_>>());
            done += batch.len() as u64;
            progress(done);
        }
    }
    out.rows.sort_by_key(|r| (r.view, plan.heights.iter().position(|h| *h == r.height)));
    if plan.steps > 0 {
        out.popping = paths(truth, contenders, plan, &style, &out.views[out.views.len() / 2]);
    }
    Ok(out)
}

impl Job<'_, '_> {
    /// Milliseconds of a picture at each of its heights; that at the largest is known.
    fn times(
        &self,
        truth: &Truth,
        view: &View,
        style: &Style,
        largest: u32,
        known: f64,
    ) -> Vec<f64> {
        self.heights
            .iter()
            .map(|&(height, knob)| {
                if height == largest {
                    return known;
                }
                let side = truth.frame.side(f64::from(height), 1);
                let camera = truth.frame.camera(view, f64::from(height), side);
                self.contender.draw(&camera, knob, style).1.render_ms
            })
            .collect()
    }
}

/// Height at which the popping test starts; each step moves away by a hundredth.
const PATH_HEIGHT: u32 = 96;
const STEP: f64 = 1.01;

fn paths(
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
    let mut rows = Vec::new();
    for c in contenders {
        // The thresholds that most pictures are seen at: one to a few pixels.
        let knobs = c.knobs(&plan.s_m, &plan.shares);
        let first = 1.min(knobs.len() - 1);
        let knob = knobs[first];
        let draw = |h: f64, knob: Knob| c.draw(&truth.frame.camera(view, h, side), knob, style).0;
        let moving: Vec<Picture> = heights.iter().map(|&h| draw(h, knob)).collect();
        let follow: Vec<Knob> = match knob {
            Knob::Points { .. } => heights.iter().map(|h| knob.nearer(heights[0] / h)).collect(),
            Knob::Share(_) => knobs[first..].iter().take(2).copied().collect(),
        };
        let still: Vec<Picture> = follow.into_iter().map(|k| draw(heights[0], k)).collect();
        let (moving, moving_worst) = changes(&moving, |i| [&truths[i], &truths[i + 1]]);
        let (still, still_worst) = changes(&still, |_| still_truth);
        rows.push(PoppingRow {
            contender: c.name.into(),
            height: PATH_HEIGHT,
            knob,
            moving,
            moving_worst,
            truth: own,
            still,
            still_worst,
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
