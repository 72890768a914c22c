//! `--bench`: times of pictures along a camera path.

use crate::args::Args;
use crate::orbit::Orbit;
use crate::output;
use crate::settings::{Settings, check};
use anyhow::{Context, Result};
use forest_gpu::{Costs, Drawn, Frame, Gpu, Layer, Model, Options, Renderer, Timer, candidates};
use forest_pack::Pack;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::Instant;

/// A camera path, as its file has it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraPath {
    /// Pictures to take, evenly spread over the keys; at least 1.
    frames: u32,
    /// Stops on the way; at least 1.
    keys: Vec<Key>,
}

/// Where the camera stands at a stop.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Key {
    /// Degrees around the tree: 0 is before it, 90 to its right.
    yaw: f64,
    /// Degrees above the horizon.
    pitch: f64,
    /// Distance from the tree's middle in half diagonals of its box, above 0.
    distance: f64,
}

/// No path has more pictures.
const MOST_FRAMES: u32 = 100_000;

/// Pictures that are drawn before any is timed.
pub(crate) const WARM_UP: usize = 10;

impl CameraPath {
    fn read(path: &Path) -> Result<Self> {
        let name = || path.display().to_string();
        let text = std::fs::read_to_string(path).with_context(name)?;
        let path: Self = serde_json::from_str(&text).with_context(name)?;
        path.validate().map_err(|e| crate::failure::Usage(format!("{}: {e}", name())))?;
        Ok(path)
    }

    fn validate(&self) -> Result<(), String> {
        if !(1..=MOST_FRAMES).contains(&self.frames) {
            return Err(format!("{} frames; from 1 to {MOST_FRAMES}", self.frames));
        }
        if self.keys.is_empty() {
            return Err("no keys".into());
        }
        for (i, key) in self.keys.iter().enumerate() {
            let finite = key.yaw.is_finite() && key.pitch.is_finite();
            if !(finite && key.distance > 0.0 && key.distance.is_finite()) {
                return Err(format!("key {i} is {key:?}; distances must be above 0"));
            }
        }
        Ok(())
    }

    /// Where the camera stands at frame `n`: linear between the keys, distances by their logarithms.
    fn at(&self, n: u32) -> Key {
        let steps = f64::from(self.frames.max(2) - 1);
        let along = f64::from(n) / steps * (self.keys.len() - 1) as f64;
        let i = (along as usize).min(self.keys.len().saturating_sub(2));
        let (a, t) = (self.keys[i], along - i as f64);
        let b = self.keys[(i + 1).min(self.keys.len() - 1)];
        Key {
            yaw: a.yaw + (b.yaw - a.yaw) * t,
            pitch: a.pitch + (b.pitch - a.pitch) * t,
            distance: a.distance * (b.distance / a.distance).powf(t),
        }
    }
}

/// What is written.
#[derive(Debug, Serialize)]
struct Report {
    adapter: String,
    pack: String,
    representation: String,
    size: [u32; 2],
    samples: u32,
    frames: usize,
    /// Milliseconds from choosing levels to the finished picture.
    frame_ms: Percentiles,
    /// Milliseconds on the device's clock, where it has one.
    device_ms: Option<Percentiles>,
    /// Points, triangles, views and cells looked at.
    primitives: Percentiles,
    draw_calls: Percentiles,
    bytes: Percentiles,
}

/// Of all pictures.
#[derive(Debug, Serialize)]
pub(crate) struct Percentiles {
    pub(crate) mean: f64,
    pub(crate) p50: f64,
    pub(crate) p95: f64,
    pub(crate) p99: f64,
}

impl Percentiles {
    /// Of at least one value; by the nearest rank.
    pub(crate) fn of(values: impl Iterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.collect();
        values.sort_by(f64::total_cmp);
        let rank = |p: f64| values[((p * values.len() as f64).ceil() as usize).max(1) - 1];
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        Self { mean, p50: rank(0.5), p95: rank(0.95), p99: rank(0.99) }
    }
}

/// A picture's times and counts.
struct Taken {
    frame_ms: f64,
    device_ms: Option<f64>,
    drawn: Drawn,
}

/// Draws the path that `args` name and writes the figures.
pub(crate) fn run(args: &Args, gpu: &Gpu, pack: &Pack) -> Result<()> {
    let bench = args.bench.as_deref().context("no --bench")?;
    let json = args.json.as_deref().context("no --json")?;
    let path = CameraPath::read(bench)?;
    let renderer = Renderer::new(gpu, &Options::default())?;
    let mut model = Model::load(gpu, &renderer, pack)?;
    let settings = Settings::new(args, &model);
    check(&settings, &model)?;
    let target = renderer.target(gpu, args.size, settings.side)?;
    let camera = |n: u32, model: &Model| {
        let Key { yaw, pitch, distance } = path.at(n);
        Orbit::new(model.bounds(), [yaw, pitch], Some(distance), args.size).camera(args.size)
    };
    let costs = match model.measures() {
        Some(_) if model.is_measured() => {
            let first = camera(0, &model);
            Costs::measure(gpu, &renderer, &mut model, &target, &first)?
        }
        _ => Costs::default(),
    };
    let timer = Timer::new(gpu);
    let mut now = None;
    let mut take = |n: u32| -> Result<Taken> {
        let start = Instant::now();
        let camera = camera(n, &model);
        let all = candidates(&model, &camera, &costs);
        now = settings.what(&model, &camera, &all, now.as_ref());
        let layers = [Layer::whole(now.context("nothing was measured")?)];
        let frame = Frame { camera, light: settings.light, wind: settings.wind, layers: &layers };
        let drawn = renderer.render(gpu, &mut model, &target, &frame, timer.as_ref())?;
        gpu.finish()?;
        let frame_ms = start.elapsed().as_secs_f64() * 1e3;
        let device_ms = timer.as_ref().map(|t| t.milliseconds(gpu)).transpose()?;
        Ok(Taken { frame_ms, device_ms, drawn })
    };
    for n in (0..path.frames).cycle().take(WARM_UP) {
        take(n)?;
    }
    let taken = (0..path.frames).map(take).collect::<Result<Vec<_>>>()?;
    let of = |value: fn(&Taken) -> f64| Percentiles::of(taken.iter().map(value));
    let report = Report {
        adapter: gpu.name(),
        pack: pack.path().display().to_string(),
        representation: format!("{:?}", settings.representation).to_lowercase(),
        size: args.size,
        samples: settings.side,
        frames: taken.len(),
        frame_ms: of(|t| t.frame_ms),
        device_ms: timer.as_ref().map(|_| of(|t| t.device_ms.unwrap_or(0.0))),
        primitives: of(|t| t.drawn.primitives() as f64),
        draw_calls: of(|t| t.drawn.calls as f64),
        bytes: of(|t| t.drawn.bytes as f64),
    };
    let text = serde_json::to_string_pretty(&report)?;
    output::write_file(json, text.as_bytes())?;
    if !args.quiet {
        let Percentiles { p50, p95, p99, .. } = report.frame_ms;
        eprintln!("{}: {p50:.2} ms (p95 {p95:.2}, p99 {p99:.2})", report.adapter);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_go_from_key_to_key() {
        let text = r#"{"frames": 5, "keys": [{"yaw": 0, "pitch": 10, "distance": 2},
            {"yaw": 90, "pitch": 10, "distance": 8}, {"yaw": 90, "pitch": 50, "distance": 8}]}"#;
        let path: CameraPath = serde_json::from_str(text).unwrap();
        path.validate().unwrap();
        let at = |n| {
            let Key { yaw, pitch, distance } = path.at(n);
            [yaw, pitch, distance].map(|v| (v * 1e6).round() / 1e6)
        };
        assert_eq!((at(0), at(1)), ([0.0, 10.0, 2.0], [45.0, 10.0, 4.0]));
        assert_eq!((at(2), at(4)), ([90.0, 10.0, 8.0], [90.0, 50.0, 8.0]));
        let still: CameraPath = serde_json::from_str(
            r#"{"frames": 1, "keys": [{"yaw": 5, "pitch": 0, "distance": 3}]}"#,
        )
        .unwrap();
        assert_eq!(still.at(0).yaw, 5.0);
        let none = CameraPath { frames: 0, keys: vec![] };
        assert_eq!(none.validate().unwrap_err(), "0 frames; from 1 to 100000");
    }

    #[test]
    fn percentiles_are_of_the_nearest_rank() {
        let p = Percentiles::of((1..=100).rev().map(f64::from));
        assert_eq!([p.mean, p.p50, p.p95, p.p99], [50.5, 50.0, 95.0, 99.0]);
        assert_eq!(Percentiles::of([7.0].into_iter()).p99, 7.0);
    }
}
