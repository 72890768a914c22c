//! What pictures cost.

use anyhow::Result;
use forest_draw::{FoliageScene, ViewsLevel, VolumeScene, draw_points, read_surfaces};
use forest_foliage::{FoliageBlock, Wind};
use forest_gpu::{
    Drawn, Frame, Gpu, Layer, Model, Options, Renderer, Target, Timer, What, read_samples,
};
use forest_pack::Pack;
use forest_points::{PixelArea, PointsBlock, Thresholds};
use forest_raster::{Light, Picture, Sampling, Style};
use forest_soup::Camera;
use forest_tests::pictures::rmse;
use forest_views::{Lookup, ViewsBlock};
use forest_volume::{Blending, Detail, VolumeBlock};
use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

const SIZE: [u32; 2] = [1280, 720];
const WARM_UP: usize = 3;
const FRAMES: usize = 15;

pub(crate) fn head(text: &mut String) -> Result<()> {
    writeln!(text, "## Times and parity\n")?;
    writeln!(
        text,
        "| tree | drawn | primitives | kB | draw calls | frame, ms | device, ms | parity |\n\
         |---|---|---|---|---|---|---|---|"
    )?;
    Ok(())
}

/// A way to draw, its name, and the options of its renderer.
struct Way {
    name: String,
    what: What,
    options: Options,
}

fn ways() -> Vec<Way> {
    let points = |finest: f64, largest: f64| {
        let [finest, largest, depth_bias] = [finest, largest, 0.0].map(PixelArea);
        What::Points(Thresholds { finest, largest, depth_bias })
    };
    let way = |name: &str, what, options| Way { name: name.into(), what, options };
    let usual = Options::default();
    let narrow = Options { narrow_atomics: true, ..usual };
    let quads = Options { splat_most: 0, ..usual };
    let mut all = vec![
        way("triangles", What::Points(Thresholds::TRIANGLES), usual),
        way("points, s_m 0.25 px²", points(0.25, 1e9), usual),
        way("the same, 32-bit atomics", points(0.25, 1e9), narrow),
        way("the same, as quads", points(0.25, 1e9), quads),
        way("points, s_m 1 px², and triangles", points(1.0, 16.0), usual),
        way("points, s_m 16 px²", points(16.0, 1e9), usual),
    ];
    for lookup in Lookup::ALL {
        all.push(way(&format!("views, {}", lookup.name()), What::Views(0, lookup), usual));
    }
    let detail = |texel| Detail::Planes { texel, fade: Detail::FADE };
    for texel in [1.0, 4.0] {
        let what = What::Volume(detail(texel), Blending::Shares);
        all.push(way(&format!("volume, texels of {texel} px"), what, usual));
    }
    all
}

/// The rows of a tree.
pub(crate) fn write(text: &mut String, gpu: &Gpu, name: &str, path: &Path) -> Result<()> {
    let pack = Pack::open(path)?;
    for way in ways() {
        let renderer = Renderer::new(gpu, &way.options)?;
        let mut model = Model::load(gpu, &renderer, &pack)?;
        let target = renderer.target(gpu, SIZE, 1)?;
        let camera = Camera::around(model.bounds(), [30.0, 10.0], Some(4.0), SIZE);
        let (drawn, frame_ms, device_ms) =
            timed(gpu, &renderer, &mut model, &target, &camera, way.what)?;
        let pixels = read_samples(gpu, &target)?;
        let picture = Picture { pixels, ..Picture::empty(SIZE[0], SIZE[1]) };
        let parity = rmse(&picture, &by_draw(&pack, &camera, way.what)?);
        let device = device_ms.map_or("–".into(), |ms| format!("{ms:.1}"));
        writeln!(
            text,
            "| {name} | {} | {} | {} | {} | {frame_ms:.1} | {device} | {parity:.4} |",
            way.name,
            drawn.primitives(),
            drawn.bytes / 1000,
            drawn.calls,
        )?;
    }
    Ok(())
}

/// What a picture took, and medians of its times.
fn timed(
    gpu: &Gpu,
    renderer: &Renderer,
    model: &mut Model,
    target: &Target,
    camera: &Camera,
    what: What,
) -> Result<(Drawn, f64, Option<f64>)> {
    let timer = Timer::new(gpu);
    let layers = [Layer::whole(what)];
    let frame =
        Frame { camera: *camera, light: Light::Albedo, wind: Wind::default(), layers: &layers };
    let (mut frames, mut device) = (Vec::new(), Vec::new());
    let mut drawn = Drawn::default();
    for round in 0..WARM_UP + FRAMES {
        let start = Instant::now();
        drawn = renderer.render(gpu, model, target, &frame, timer.as_ref())?;
        gpu.finish()?;
        if round >= WARM_UP {
            frames.push(start.elapsed().as_secs_f64() * 1e3);
            if let Some(timer) = &timer {
                device.push(timer.milliseconds(gpu)?);
            }
        }
    }
    let median = |mut v: Vec<f64>| {
        v.sort_by(f64::total_cmp);
        v.get(v.len() / 2).copied()
    };
    Ok((drawn, median(frames).unwrap_or(0.0), median(device)))
}

/// The picture that the CPU draws.
fn by_draw(pack: &Pack, camera: &Camera, what: What) -> Result<Picture> {
    let style = Style { sampling: Sampling::MIDDLE, light: Light::Albedo };
    Ok(match what {
        What::Points(thresholds) => {
            let block = PointsBlock::open(pack)?;
            let surfaces = read_surfaces(pack, &block)?;
            draw_points(&block, surfaces.as_ref(), camera, &thresholds, style).0
        }
        What::Views(level, lookup) => {
            let block = ViewsBlock::open(pack)?;
            ViewsLevel::read(&block, level)?.draw(camera, lookup, style).0
        }
        What::Foliage(level) => {
            let block = FoliageBlock::open(pack)?;
            FoliageScene::read(&block)?.draw(camera, level, &Wind::default(), &style)
        }
        What::Volume(detail, blending) => {
            let block = VolumeBlock::open(pack)?;
            VolumeScene::read(&block)?.draw(camera, detail, blending, style).0
        }
    })
}
