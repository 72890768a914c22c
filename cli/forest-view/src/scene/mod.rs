//! Scene files: pictures and benches without a window.

mod bench;

pub(crate) use bench::run as bench;

use crate::args::Args;
use crate::failure::Usage;
use crate::output;
use anyhow::{Context, Result};
use forest_gpu::{
    Gpu, Landscape, LandscapeDetail, LandscapeDrawn, LandscapeRenderer, LandscapeTarget, Look,
    Options, read_picture,
};
use forest_points::{PixelArea, Thresholds};
use forest_scene::{Scene, Sight};
use std::path::Path;

/// Whether a file is a scene file, by its name.
pub(crate) fn is_scene(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"))
}

/// Draws the picture that `args` ask for.
pub(crate) fn headless(args: &Args, gpu: &Gpu, scene: &Scene) -> Result<()> {
    let output = args.output.as_ref().context("no --output")?;
    let camera = sight(args, scene)?.camera(&scene.land, args.size);
    let renderer = LandscapeRenderer::new(gpu, &Options::default())?;
    let mut landscape = Landscape::load(gpu, &renderer, scene)?;
    let target = LandscapeTarget::new(gpu, &renderer, args.size, args.samples)?;
    renderer.render(gpu, &mut landscape, &target, &camera, &detail(args), None);
    let drawn = landscape.drawn(gpu)?;
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
    let largest = args.largest.unwrap_or(args.finest * Thresholds::LARGEST_RATIO);
    LandscapeDetail {
        finest: PixelArea(args.finest),
        largest: PixelArea(largest),
        hidden: args.hidden,
        ..LandscapeDetail::default()
    }
}

/// What a picture took, in words.
fn describe(drawn: &LandscapeDrawn) -> String {
    let LandscapeDrawn { looked_at, trees, points, triangles, ground, left_out } = drawn;
    let rest = match left_out {
        0 => String::new(),
        n => format!("; NO ROOM for {n} runs"),
    };
    format!(
        "{trees} of {looked_at} trees, {points} points, {triangles} triangles, {ground} of ground{rest}"
    )
}
