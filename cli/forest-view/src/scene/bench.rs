//! `--bench` of a scene: times of pictures along a path of its file.

use crate::args::Args;
use crate::bench::{Percentiles, WARM_UP};
use crate::failure::Usage;
use crate::output;
use anyhow::{Context, Result};
use forest_gpu::{
    Gpu, Landscape, LandscapeDrawn, LandscapeRenderer, LandscapeTarget, Options, Timer,
};
use forest_scene::Scene;
use serde::Serialize;
use std::time::Instant;

/// What is written.
#[derive(Debug, Serialize)]
struct Report {
    adapter: String,
    scene: String,
    path: String,
    trees: usize,
    size: [u32; 2],
    samples: u32,
    frames: usize,
    /// Milliseconds from choosing tiles to the finished picture.
    frame_ms: Percentiles,
    /// Milliseconds on the device's clock, where it has one.
    device_ms: Option<Percentiles>,
    /// Trees that were drawn.
    trees_drawn: Percentiles,
    /// Points that were looked at, triangles of trees and of the ground.
    primitives: Percentiles,
    /// Bytes of the scene on the device.
    device_bytes: u64,
    /// Seconds of opening, uploading and making opacity maps.
    load_s: f64,
}

/// Draws the path that `args` name and writes the figures.
pub(crate) fn run(args: &Args, gpu: &Gpu, scene: &Scene, start: Instant) -> Result<()> {
    let name = args.bench.as_deref().context("no --bench")?.display().to_string();
    let json = args.json.as_deref().context("no --json")?;
    let path = scene.file.paths.iter().find(|p| p.name == name);
    let wrong = || Usage(format!("{}: no path is named {name}", scene.path.display()));
    let sights = scene.file.along(path.ok_or_else(wrong)?);
    let renderer = LandscapeRenderer::new(gpu, &Options::default())?;
    let mut landscape = Landscape::load(gpu, &renderer, scene)?;
    let target = LandscapeTarget::new(gpu, &renderer, args.size, args.samples)?;
    let load_s = start.elapsed().as_secs_f64();
    let (timer, mut goal) = (Timer::new(gpu), super::Goal::new(args, scene)?);
    let mut take = |i: usize| -> Result<(f64, Option<f64>, LandscapeDrawn)> {
        let camera = sights[i].camera(&scene.land, args.size);
        let start = Instant::now();
        renderer.render(gpu, &mut landscape, &target, &camera, &goal.detail(), timer.as_ref());
        gpu.finish()?;
        let frame_ms = start.elapsed().as_secs_f64() * 1e3;
        goal.took(frame_ms);
        let device_ms = timer.as_ref().map(|t| t.milliseconds(gpu)).transpose()?;
        Ok((frame_ms, device_ms, landscape.drawn(gpu)?))
    };
    for i in (0..sights.len()).cycle().take(WARM_UP) {
        take(i)?;
    }
    let taken = (0..sights.len()).map(take).collect::<Result<Vec<_>>>()?;
    let report = Report {
        adapter: gpu.name(),
        scene: scene.path.display().to_string(),
        path: name,
        trees: scene.trees.len(),
        size: args.size,
        samples: args.samples,
        frames: taken.len(),
        frame_ms: Percentiles::of(taken.iter().map(|t| t.0)),
        device_ms: timer
            .as_ref()
            .map(|_| Percentiles::of(taken.iter().map(|t| t.1.unwrap_or(0.0)))),
        trees_drawn: Percentiles::of(taken.iter().map(|t| t.2.trees as f64)),
        primitives: Percentiles::of(taken.iter().map(|t| t.2.primitives() as f64)),
        device_bytes: landscape.bytes(),
        load_s,
    };
    output::write_file(json, serde_json::to_string_pretty(&report)?.as_bytes())?;
    if !args.quiet {
        let Percentiles { p50, p95, p99, .. } = report.frame_ms;
        eprintln!("{}: {p50:.2} ms (p95 {p95:.2}, p99 {p99:.2})", report.adapter);
    }
    Ok(())
}
