//! The sweep: truth and contenders, view by view and height by height.

use crate::contender::{Contender, Cost, Knob};
use crate::error::EvalError;
use crate::frame::{View, held_out_views};
use crate::metrics::{Comparison, Errors};
use crate::path::{PoppingRow, paths};
use crate::plan::{BACKGROUND, Plan};
use crate::truth::Truth;
use forest_raster::{Picture, Style};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::time::Instant;

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
    let batch = pictures_in_flight(side);
    let mut done = 0;
    for (v, view) in (0..).zip(&out.views) {
        let camera = truth.frame.camera(view, f64::from(largest), side);
        let whole = truth.picture(view, f64::from(largest), side);
        let truths: Vec<Picture> =
            plan.heights.par_iter().map(|h| whole.box_filtered(largest / h)).collect();
        // Drawn one by one, so that their times are their own, and judged together.
        for batch in jobs.chunks(batch) {
            let mut tasks = Vec::new();
            for job in batch {
                let (picture, cost) = job.contender.draw(&camera, job.knob, &style);
                let picture = std::sync::Arc::new(picture);
                for &(height, knob) in &job.heights {
                    let render_ms = (v == 0).then(|| job.time(truth, view, &style, height, knob));
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

/// Bytes of pictures that are held at once.
const PICTURES: u64 = 1 << 30;

/// How many pictures of `side` pixels are drawn before they are judged.
fn pictures_in_flight(side: u32) -> usize {
    let bytes = 32 * u64::from(side) * u64::from(side);
    (PICTURES / bytes).clamp(1, 2 * rayon::current_num_threads() as u64) as usize
}

impl Job<'_, '_> {
    /// Milliseconds of a picture at its own height; the caller has drawn the same things before.
    fn time(&self, truth: &Truth, view: &View, style: &Style, height: u32, knob: Knob) -> f64 {
        let side = truth.frame.side(f64::from(height), 1);
        let camera = truth.frame.camera(view, f64::from(height), side);
        let start = Instant::now();
        self.contender.draw(&camera, knob, style);
        start.elapsed().as_secs_f64() * 1e3
    }
}
