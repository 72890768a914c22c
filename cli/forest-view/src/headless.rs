//! One picture without a window.

use crate::args::Args;
use crate::orbit::Orbit;
use crate::output;
use crate::sequence::Sequence;
use crate::settings::{Settings, check};
use crate::truth::Truth;
use anyhow::{Context, Result};
use forest_gpu::{
    Costs, Frame, Gpu, Layer, Look, Model, Options, Renderer, What, candidates, read_picture,
};
use forest_pack::Pack;
use forest_soup::Camera;

/// Draws the picture that `args` ask for.
pub(crate) fn run(args: &Args, gpu: &Gpu, pack: &Pack, angles: [f64; 2]) -> Result<()> {
    let output = args.output.as_ref().context("no --output")?;
    let renderer = Renderer::new(gpu, &Options::default())?;
    let mut model = Model::load(gpu, &renderer, pack)?;
    let settings = Settings::new(args, &model);
    check(&settings, &model)?;
    let camera = match args.parallel {
        true => Camera::around(model.bounds(), angles, None, args.size),
        false => Orbit::new(model.bounds(), angles, args.distance, args.size).camera(args.size),
    };
    let target = renderer.target(gpu, args.size, settings.side)?;
    let costs = match settings.representation {
        crate::args::Representation::Auto => {
            Costs::measure(gpu, &renderer, &mut model, &target, &camera)?
        }
        _ => Costs::default(),
    };
    let all = candidates(&model, &camera, &costs);
    let what = settings.what(&model, &camera, &all, None).context("nothing was measured")?;
    let layers = [Layer::whole(what)];
    let frame = Frame { camera, light: settings.light, wind: settings.wind, layers: &layers };
    if let (What::Points(thresholds), Some(points), false) = (&what, model.points(), args.quiet)
        && points.is_beyond(&camera, thresholds)
    {
        let (name, finest) = (pack.path().display(), thresholds.finest.0);
        eprintln!(
            "warning: {name}: pruned; has no points of {finest} px² here, the finest are drawn"
        );
    }
    if let Some(seconds) = args.sequence {
        let (mut sequence, winds) = Sequence::new(args, seconds, output)?;
        for wind in winds {
            renderer.render(gpu, &mut model, &target, &Frame { wind, ..frame.clone() }, None)?;
            let look = Look { alpha: args.alpha, ..Look::default() };
            let pixels = read_picture(gpu, &target, &look, None)?;
            sequence.add(args.size, &pixels, args.alpha)?;
        }
        let written = sequence.finish()?;
        if !args.quiet {
            eprintln!("{}: {written}", gpu.name());
        }
        return Ok(());
    }
    let drawn = renderer.render(gpu, &mut model, &target, &frame, None)?;
    gpu.finish()?;
    let truth = match &args.truth {
        None => None,
        Some(path) => {
            let truth = Truth::load(path, args.max_triangles, model.crown().is_some())?;
            Some(truth.picture(&camera, &settings.light, settings.side))
        }
    };
    let half = args.size[0] as f32 * 0.5;
    let look = Look {
        alpha: args.alpha,
        split: truth.as_ref().map_or(0.0, |_| half.floor()),
        ..Look::default()
    };
    let other = truth.as_ref().map(|t| ([t.width, t.height], &t.pixels[..]));
    let pixels = read_picture(gpu, &target, &look, other)?;
    output::write_png(output, args.size, &pixels, args.alpha)?;
    if !args.quiet {
        eprintln!("{}: {}", gpu.name(), output::describe(&what, &drawn));
    }
    Ok(())
}
