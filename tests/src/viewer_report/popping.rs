//! Whether a change of level is seen: pictures from step to step of a camera that moves away.

use anyhow::{Context, Result};
use forest_foliage::Wind;
use forest_gpu::{
    Costs, Fader, Frame, Goal, Gpu, JUST_NOTICEABLE, Layer, Model, Options, Renderer, Target, What,
    candidates, read_samples,
};
use forest_pack::Pack;
use forest_raster::{Light, Picture, Sampling, Style, Surfaces, rasterize};
use forest_soup::{Camera, Projection, TriangleSoup};
use forest_tests::pictures::rmse;
use forest_tests::reports::load_soup;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

const SIZE: [u32; 2] = [480, 480];
/// Samples along the side of a pixel.
const SIDE: u32 = 4;
/// Steps of the camera, each away by this share, at so many pictures a second.
const STEPS: usize = 240;
const STEP: f64 = 1.012;
const RATE: f32 = 30.0;
/// FLIP errors that levels are chosen for.
const GOALS: [f32; 2] = [0.03, JUST_NOTICEABLE];
/// Half diagonals of the box at the first step.
const NEAREST: f64 = 3.0;

/// Changes from picture to picture.
#[derive(Default)]
struct Changes {
    all: Vec<f64>,
    /// Largest while levels change, and largest of the others.
    switching: f64,
    steady: f64,
    switches: usize,
    levels: BTreeMap<String, usize>,
}

pub(crate) fn write(
    text: &mut String,
    gpu: &Gpu,
    name: &str,
    path: &Path,
    tree: &Path,
) -> Result<()> {
    let pack = Pack::open(path)?;
    let soup = load_soup(tree)?;
    let of_source = source_changes(&soup, &pack, gpu)?;
    writeln!(
        text,
        "\n## Popping: {name}\n\nThe camera moves away by {:.1} % a step, {RATE} steps a second, {STEPS} steps; \
         *auto* chooses levels for a FLIP error. Given is the RMSE from each picture to the next \
         ({} × {} pixels, {} samples each), with levels that are switched at once and levels that fade for \
         0.3 s. The source itself changes by {:.4} in the mean and {:.4} at most.\n\n\
         | FLIP | switches | mean change | largest change while a level changes | largest of the others |\n\
         |---|---|---|---|---|",
        (STEP - 1.0) * 100.0,
        SIZE[0],
        SIZE[1],
        SIDE * SIDE,
        mean(&of_source),
        of_source.iter().copied().fold(0.0, f64::max),
    )?;
    let mut levels = BTreeMap::new();
    for (goal, seconds) in GOALS.into_iter().flat_map(|g| [(g, 0.0), (g, 0.3)]) {
        let c = changes(gpu, &pack, Goal::Error(goal), seconds)?;
        let name = if seconds > 0.0 { "fading" } else { "at once" };
        writeln!(
            text,
            "| {goal}, {name} | {} | {:.4} | {:.4} | {:.4} |",
            c.switches,
            mean(&c.all),
            c.switching,
            c.steady
        )?;
        levels.insert(goal.to_bits(), c.levels);
    }
    for (goal, levels) in levels {
        writeln!(
            text,
            "\nLevels on the way for {}, and steps that showed them:\n",
            f32::from_bits(goal)
        )?;
        for (level, steps) in levels {
            writeln!(text, "- {level}: {steps}")?;
        }
    }
    Ok(())
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

fn camera(model: &Model, step: usize) -> Camera {
    let distance = NEAREST * STEP.powi(step as i32);
    let around = Camera::around(model.bounds(), [30.0, 10.0], Some(distance), SIZE);
    Camera { projection: Projection::Perspective { fov_y: 0.7 }, ..around }
}

fn changes(gpu: &Gpu, pack: &Pack, goal: Goal, seconds: f32) -> Result<Changes> {
    let renderer = Renderer::new(gpu, &Options::default())?;
    let mut model = Model::load(gpu, &renderer, pack)?;
    let target = renderer.target(gpu, SIZE, SIDE)?;
    let first = camera(&model, 0);
    let costs = Costs::measure(gpu, &renderer, &mut model, &target, &first)?;
    let mut fader: Option<Fader> = None;
    let mut changes = Changes::default();
    let mut last: Option<Picture> = None;
    for step in 0..STEPS {
        let camera = camera(&model, step);
        let now = fader.as_ref().map(|f| *f.now());
        let wanted = goal.choose(&candidates(&model, &camera, &costs), now.as_ref());
        let wanted = wanted.context("a measured pack")?.what;
        *changes.levels.entry(in_words(&wanted)).or_default() += 1;
        let fader = fader.get_or_insert(Fader::new(wanted, seconds));
        fader.advance(wanted, 1.0 / RATE);
        let changed = now.is_some_and(|n| n != *fader.now());
        changes.switches += usize::from(changed);
        let (layers, count) = fader.layers();
        let picture = draw(gpu, &renderer, &mut model, &target, &camera, &layers[..count])?;
        if let Some(last) = &last {
            let change = rmse(&picture, last);
            let largest = if changed || fader.is_fading() {
                &mut changes.switching
            } else {
                &mut changes.steady
            };
            *largest = largest.max(change);
            changes.all.push(change);
        }
        last = Some(picture);
    }
    Ok(changes)
}

fn draw(
    gpu: &Gpu,
    renderer: &Renderer,
    model: &mut Model,
    target: &Target,
    camera: &Camera,
    layers: &[Layer],
) -> Result<Picture> {
    let frame = Frame { camera: *camera, light: Light::Albedo, wind: Wind::default(), layers };
    renderer.render(gpu, model, target, &frame, None)?;
    let [width, height] = SIZE.map(|n| n * SIDE);
    let pixels = read_samples(gpu, target)?;
    Ok(Picture { pixels, ..Picture::empty(width, height) }.box_filtered(SIDE))
}

/// What the source itself changes on the same way.
fn source_changes(soup: &TriangleSoup, pack: &Pack, gpu: &Gpu) -> Result<Vec<f64>> {
    let renderer = Renderer::new(gpu, &Options::default())?;
    let model = Model::load(gpu, &renderer, pack)?;
    let surfaces = Surfaces::new(&soup.materials, &soup.textures);
    let style = Style { sampling: Sampling { side: SIDE, seed: 1 }, light: Light::Albedo };
    let pictures: Vec<Picture> =
        (0..STEPS).map(|step| rasterize(soup, &surfaces, &camera(&model, step), &style)).collect();
    Ok(pictures.windows(2).map(|p| rmse(&p[0], &p[1])).collect())
}

fn in_words(what: &What) -> String {
    match what {
        What::Points(t) if t.largest.0 <= 0.0 => "triangles".into(),
        What::Points(t) => format!("points, s_m {} px²", t.finest.0),
        What::Views(level, lookup) => format!("views, level {level}, {}", lookup.name()),
        What::Foliage(level) => format!("foliage, level {level}"),
        What::Volume(detail, _) => format!("volume, {detail:?}"),
    }
}
