//! Scene files: in a window, or as pictures and benches without one.

mod bench;
mod walk;
mod window;

pub(crate) use bench::run as bench;
pub(crate) use window::run as window;

use crate::args::Args;
use crate::failure::Usage;
use crate::output;
use crate::sequence::Sequence;
use anyhow::{Context, Result};
use forest_gpu::{
    Gpu, Landscape, LandscapeDetail, LandscapeDrawn, LandscapeRenderer, LandscapeTarget, Look,
    Options, Steering, finest_for, read_picture,
};
use forest_pack::measures::Measures;
use forest_points::{PixelArea, Thresholds};
use forest_scene::{Scene, Sight};
use std::path::Path;
use std::time::Instant;

/// Whether a file is a scene file, by its name.
pub(crate) fn is_scene(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"))
}

/// Pictures that are drawn to find out what a rate leaves time for.
const STEERED: usize = 12;

/// Draws the picture that `args` ask for.
pub(crate) fn headless(args: &Args, gpu: &Gpu, scene: &Scene) -> Result<()> {
    let output = args.output.as_ref().context("no --output")?;
    let camera = sight(args, scene)?.camera(&scene.land, args.size);
    let renderer = LandscapeRenderer::new(gpu, &Options::default())?;
    let mut landscape = Landscape::load(gpu, &renderer, scene)?;
    let target = LandscapeTarget::new(gpu, &renderer, args.size, args.samples)?;
    let mut goal = Goal::new(args, scene)?;
    if let Some(seconds) = args.sequence {
        let (mut sequence, winds) = Sequence::new(args, seconds, output)?;
        for wind in winds {
            landscape.set_wind(wind);
            renderer.render(gpu, &mut landscape, &target, &camera, &goal.detail(), None);
            let pixels = read_picture(gpu, target.samples(), &Look::default(), None)?;
            sequence.add(args.size, &pixels, false)?;
        }
        let written = sequence.finish()?;
        if !args.quiet {
            eprintln!("{}: {written}", gpu.name());
        }
        return Ok(());
    }
    landscape.set_wind(args.wind.unwrap_or_default());
    let mut drawn = LandscapeDrawn::default();
    // Until a rate is reached, where one is asked for.
    let most = if args.fps.is_some() { STEERED } else { 1 };
    for _ in 0..most {
        let start = Instant::now();
        renderer.render(gpu, &mut landscape, &target, &camera, &goal.detail(), None);
        drawn = landscape.drawn(gpu)?;
        goal.took(start.elapsed().as_secs_f64() * 1e3);
    }
    let pixels = read_picture(gpu, target.samples(), &Look::default(), None)?;
    output::write_png(output, args.size, &pixels, false)?;
    if !args.quiet {
        eprintln!("{}: {}", gpu.name(), describe(&drawn));
    }
    Ok(())
}

/// Where to look from.
fn sight<'s>(args: &Args, scene: &'s Scene) -> Result<&'s Sight> {
    let found = scene.file.camera(args.camera.as_deref());
    let path = scene.path.display();
    found.ok_or_else(|| match &args.camera {
        Some(name) => Usage(format!("{path}: no camera is named {name}")).into(),
        None => Usage(format!("{path}: has no camera")).into(),
    })
}

/// How finely to draw.
fn detail(args: &Args) -> LandscapeDetail {
    let usual = LandscapeDetail::default();
    let finest = args.finest.map_or(usual.finest, PixelArea);
    let largest = args.largest.unwrap_or(finest.0 * Thresholds::LARGEST_RATIO);
    let (hidden, least_seen, impostors) = (args.hidden, args.least_seen, args.impostors);
    let largest = PixelArea(largest);
    LandscapeDetail { finest, largest, hidden, least_seen, impostors, ..usual }
}

/// How finely to draw, from picture to picture.
#[derive(Clone, Debug)]
pub(crate) struct Goal {
    detail: LandscapeDetail,
    steering: Option<Steering>,
}

impl Goal {
    /// As `args` say: for a rate, for an error, or as given.
    pub(crate) fn new(args: &Args, scene: &Scene) -> Result<Self> {
        let mut detail = detail(args);
        if let (Some(error), None) = (args.error, args.fps) {
            let tables: Vec<_> = scene
                .species
                .iter()
                .map(|s| Measures::read(&s.pack).map(|m| (s, m)))
                .collect::<Result<_, _>>()?;
            if let Some((s, _)) = tables.iter().find(|(_, m)| m.is_none()) {
                let pack = s.pack.path().display();
                let text = "--error needs a measured table: bake with points --measure";
                return Err(Usage(format!("{pack}: {text}")).into());
            }
            let found = finest_for(tables.iter().filter_map(|(_, m)| m.as_ref()), error);
            let none = || Usage(format!("--error {error}: no level of all packs is so good"));
            detail.finest = found.ok_or_else(none)?;
            detail.largest = PixelArea(detail.finest.0 * Thresholds::LARGEST_RATIO);
        }
        let steering = args.fps.map(|rate| Steering::new(rate, &detail));
        Ok(Self { detail, steering })
    }

    /// How to draw the next picture.
    pub(crate) fn detail(&self) -> LandscapeDetail {
        self.detail
    }

    /// Takes in what a picture took.
    pub(crate) fn took(&mut self, ms: f64) {
        if let Some(steering) = &mut self.steering {
            self.detail = steering.next(ms, &self.detail);
        }
    }

    /// Makes points so many times as large, where no rate is asked for.
    pub(crate) fn scale(&mut self, factor: f64) {
        let (finest, largest) = (self.detail.finest.0, self.detail.largest.0);
        self.detail.finest = PixelArea((finest * factor).clamp(0.05, 4096.0));
        self.detail.largest = PixelArea((largest * factor).clamp(0.8, 65536.0));
    }
}

/// What a picture took, in words.
fn describe(drawn: &LandscapeDrawn) -> String {
    let LandscapeDrawn { looked_at, trees, impostors, points, triangles, ground, .. } = drawn;
    let LandscapeDrawn { left_out, beyond, .. } = drawn;
    let mut rest = String::new();
    if *left_out > 0 {
        rest += &format!("; NO ROOM for {left_out} runs");
    }
    if *beyond > 0 {
        rest += &format!(
            "; {beyond} trees and cells ask for finer points than their pruned packs have"
        );
    }
    format!(
        "{trees} of {looked_at} trees, {impostors} by views, {points} points, {triangles} triangles, \
         {ground} of ground{rest}"
    )
}
