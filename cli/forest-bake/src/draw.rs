//! `forest-bake draw`.

use crate::failure::Usage;
use crate::light::LightArg;
use crate::log::Log;
use crate::output;
use anyhow::{Context, Result, bail};
use forest_draw::{
    CrownStyle, FoliageScene, ViewsLevel, VolumeScene, draw_bent_points, draw_points, read_surfaces,
};
use forest_foliage::{BentPoints, FoliageBlock, PointsWind, Pose, Wind};
use forest_pack::Pack;
use forest_pack::measures::{ErrorKind, Measures};
use forest_points::{PixelArea, PointsBlock, Thresholds, within_budget};
use forest_raster::{Picture, Sampling, Style};
use forest_soup::{Camera, named_view};
use forest_views::{Lookup, ViewsBlock, select};
use forest_volume::{Blending, Detail, VolumeBlock};
use glam::DVec3;
use image::{DynamicImage, ImageFormat, RgbImage, RgbaImage};
use std::io::Cursor;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Pack to draw.
    #[arg(value_name = "PACK")]
    pack: PathBuf,
    /// PNG to write; - is standard output.
    #[arg(short, long, value_name = "PNG")]
    output: PathBuf,
    /// Side of the picture in pixels.
    #[arg(long, default_value_t = 512, value_parser = clap::value_parser!(u32).range(1..=16384))]
    size: u32,
    /// front, back, left, right, top, diagonal, or YAW,PITCH in degrees: where the camera stands.
    #[arg(long, default_value = "front", value_name = "VIEW", allow_hyphen_values = true)]
    view: String,
    /// Perspective camera at this many block radii from the centre, instead of a parallel one.
    #[arg(long, value_name = "RADII")]
    distance: Option<f64>,
    /// s_m, smallest projected area of a point in square pixels; several give pictures side by side.
    #[arg(long, default_value = "1", value_delimiter = ',', value_name = "PX2")]
    finest: Vec<f64>,
    /// s_M, largest projected area of a point: larger ones are drawn as triangles. Default: 16 times
    /// s_m.
    #[arg(long, value_name = "PX2")]
    largest: Option<f64>,
    /// k, added to both at the back of the block and taken from them at its front.
    #[arg(long, default_value_t = 0.0, value_name = "PX2", allow_hyphen_values = true)]
    bias: f64,
    /// Choose the cheapest level whose FLIP error is at most this in all measured views, by the
    /// pack's table (`points --measure`, `eval --embed`).
    #[arg(long, value_name = "FLIP", value_parser = positive)]
    #[arg(conflicts_with_all = ["finest", "largest", "bias", "budget"])]
    error: Option<f32>,
    /// Draw the finest cut of at most this many points and triangles.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    #[arg(conflicts_with_all = ["finest", "largest", "bias"])]
    budget: Option<u64>,
    /// Draw this representation; default: points, if the pack has them.
    #[arg(long = "as", value_enum, value_name = "WHAT")]
    what: Option<Representation>,
    /// How views are looked up; several give pictures side by side.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "depth")]
    lookup: Vec<LookupArg>,
    /// Levels of a volume, 0 is the root, or of foliage, 0 is the finest; several give pictures side by
    /// side. Default: by --texel.
    #[arg(long, value_delimiter = ',', value_name = "N")]
    level: Vec<u32>,
    /// How the billboards of a volume's two nearest cameras make one.
    #[arg(long, value_enum, default_value = "shares")]
    blend: BlendArg,
    /// Largest width of a texel in pixels: what chooses the level of views and foliage, and cells of a
    /// volume.
    #[arg(long, default_value_t = 1.0, value_name = "PX", value_parser = positive_wide)]
    texel: f64,
    /// Wind that foliage, and points in a pack with foliage, stand in: its strength (0 calm, 1 a gale, at
    /// most 2), or STRENGTH,SECONDS at a moment.
    #[arg(long, default_value = "0", value_name = "WIND")]
    wind: Wind,
    /// Light: a sun with shadows on foliage, and by its crown on all else in a pack with foliage; none
    /// in others.
    #[arg(long, value_enum, default_value = "sun")]
    light: LightArg,
    /// Samples a side of a pixel.
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=16))]
    samples: u32,
    /// Straight alpha instead of a grey background.
    #[arg(long)]
    alpha: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Representation {
    /// Points, and triangles near the camera.
    Points,
    /// Views.
    Views,
    /// Billboards of an octree, in the light of their photographs.
    Volume,
    /// Cards of leaves, sheets of twigs, tubes of branches.
    Foliage,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum BlendArg {
    /// Their mean; what one does not know is the other's.
    Shares,
    /// One over the other: the paper's way.
    Over,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum LookupArg {
    /// The nearest view.
    Nearest,
    /// The three views around, by their shares.
    Blend,
    /// The three views around, followed through their depth.
    Depth,
}

impl From<LookupArg> for Lookup {
    fn from(l: LookupArg) -> Self {
        match l {
            LookupArg::Nearest => Self::Nearest,
            LookupArg::Blend => Self::Blend,
            LookupArg::Depth => Self::Depth,
        }
    }
}

/// A number above zero.
fn positive_wide(text: &str) -> Result<f64, String> {
    positive(text).map(f64::from)
}

/// A number above zero.
fn positive(text: &str) -> Result<f32, String> {
    let value: f32 = text.parse().map_err(|_| "not a number".to_string())?;
    if value > 0.0 { Ok(value) } else { Err("it must be above 0".into()) }
}

pub(crate) fn run(args: &Args, log: Log) -> Result<()> {
    let is_png = args.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
    if !is_png && !is_stdout(&args.output) {
        return Err(
            Usage(format!("{}: pictures are written as .png", args.output.display())).into()
        );
    }
    let pack = Pack::open(&args.pack)?;
    let style =
        Style { sampling: Sampling { side: args.samples, seed: 1 }, light: args.light.light() };
    let found = [
        (PointsBlock::is_in(&pack), Representation::Points),
        (ViewsBlock::is_in(&pack), Representation::Views),
        (VolumeBlock::is_in(&pack), Representation::Volume),
        (FoliageBlock::is_in(&pack), Representation::Foliage),
    ];
    // Without any, opening points says what is missing.
    let found = found.into_iter().find(|f| f.0).map_or(Representation::Points, |f| f.1);
    let what = args.what.unwrap_or(found);
    if args.wind.strength > 0.0 && matches!(what, Representation::Views | Representation::Volume) {
        let problem = "--wind: views and volumes lean as a whole, in forest-view alone";
        return Err(Usage(problem.into()).into());
    }
    let pictures = match what {
        Representation::Points => draw_all_points(args, &pack, &style, log)?,
        Representation::Views => draw_all_views(args, &pack, &style, log)?,
        Representation::Volume => draw_all_volumes(args, &pack, &style, log)?,
        Representation::Foliage => draw_all_foliage(args, &pack, &style, log)?,
    };
    write(args, &pictures)
}

impl Args {
    /// The foliage of a pack that its points bend with; `None` in a calm.
    fn points_in_wind<'p>(
        &self,
        pack: &'p Pack,
        block: &PointsBlock,
    ) -> Result<Option<(FoliageBlock<'p>, PointsWind<'p>)>> {
        if self.wind.strength <= 0.0 {
            return Ok(None);
        }
        let foliage = FoliageBlock::is_in(pack).then(|| FoliageBlock::open(pack)).transpose()?;
        let wind = match &foliage {
            Some(foliage) => PointsWind::read(pack, block, foliage.branches.len())?,
            None => None,
        };
        let untied = "--wind: the points do not know of branches; add foliage to their pack";
        Ok(Some(foliage.zip(wind).ok_or_else(|| Usage(untied.into()))?))
    }
}

fn draw_all_points(args: &Args, pack: &Pack, style: &Style, log: Log) -> Result<Vec<Picture>> {
    let block = PointsBlock::open(pack)?;
    let surfaces = read_surfaces(pack, &block)?;
    let [min, max] = [block.header.min, block.header.max].map(|v| block.to_world(v.into()));
    let camera = args.camera([min, max])?;
    let on_crown = CrownStyle::read(pack, style)?;
    let lit = on_crown.seen_from(camera.to_eye(0.5 * (min + max)));
    let tied = args.points_in_wind(pack, &block)?;
    let pose = tied.as_ref().map(|(f, _)| Pose::new(f.branches, &args.wind, 0.0));
    let bent = tied.as_ref().zip(pose.as_ref()).map(|((f, w), pose)| BentPoints::new(f, w, pose));
    let mut pictures = Vec::new();
    for thresholds in args.levels(pack, &block, &camera, log)? {
        let (surfaces, cut) = (surfaces.as_ref(), &thresholds);
        let (picture, drawn) = match &bent {
            Some(bent) => draw_bent_points(&block, surfaces, &camera, cut, lit, bent),
            None => draw_points(&block, surfaces, &camera, cut, lit),
        };
        if block.is_beyond(&camera, &thresholds) {
            let (name, finest) = (pack.path().display(), thresholds.finest.0);
            log.warn(format!(
                "{name}: pruned; has no points of {finest} px² here, the finest are drawn"
            ));
        }
        if log.says() {
            eprintln!(
                "s_m {} px²: {} points, {} triangles, coverage {:.4}",
                thresholds.finest.0,
                drawn.points,
                drawn.triangles,
                picture.mean_coverage()
            );
        }
        pictures.push(picture);
    }
    Ok(pictures)
}

fn draw_all_views(args: &Args, pack: &Pack, style: &Style, log: Log) -> Result<Vec<Picture>> {
    if args.error.is_some() || args.budget.is_some() {
        bail!(Usage("--error and --budget choose levels of points; --texel those of views".into()));
    }
    let block = ViewsBlock::open(pack)?;
    let bounds = block.header.bounds.map(|b| block.center() + DVec3::from_array(b));
    let camera = args.camera(bounds)?;
    let on_crown = CrownStyle::read(pack, style)?;
    let lit = on_crown.seen_from(camera.to_eye(block.center()));
    let mut pictures = Vec::new();
    for lookup in args.lookup.iter().map(|&l| Lookup::from(l)) {
        let chosen = select(&block, &camera, lookup, args.texel);
        let level = ViewsLevel::read(&block, chosen.level)?;
        let (picture, drawn) = level.draw(&camera, lookup, lit);
        if log.says() {
            eprintln!(
                "{}: {} of {} views of {}² texels, {}, coverage {:.4}",
                lookup.name(),
                drawn.views,
                block.directions().count(),
                level.side(),
                output::bytes(drawn.bytes),
                picture.mean_coverage()
            );
        }
        pictures.push(picture);
    }
    Ok(pictures)
}

fn draw_all_foliage(args: &Args, pack: &Pack, style: &Style, log: Log) -> Result<Vec<Picture>> {
    if args.error.is_some() || args.budget.is_some() {
        let rule =
            "--error and --budget choose levels of points; --level and --texel those of foliage";
        bail!(Usage(rule.into()));
    }
    let block = FoliageBlock::open(pack)?;
    let camera = args.camera(block.bounds())?;
    let coarsest = block.header.levels.len() as u32 - 1;
    if let Some(level) = args.level.iter().find(|l| **l > coarsest) {
        bail!(Usage(format!("--level {level}: the coarsest level of the pack is {coarsest}")));
    }
    let mut levels: Vec<usize> = args.level.iter().map(|&l| l as usize).collect();
    if levels.is_empty() {
        levels.push(block.select(&camera, args.texel));
    }
    let scene = FoliageScene::read(&block)?;
    let mut pictures = Vec::new();
    for level in levels {
        let picture = scene.draw(&camera, level, &args.wind, style);
        if log.says() {
            let header = &block.header.levels[level];
            eprintln!(
                "level {level}: texel {:.4}, {} triangles, coverage {:.4}",
                header.texel,
                header.triangles(),
                picture.mean_coverage()
            );
        }
        pictures.push(picture);
    }
    Ok(pictures)
}

fn draw_all_volumes(args: &Args, pack: &Pack, style: &Style, log: Log) -> Result<Vec<Picture>> {
    if args.error.is_some() || args.budget.is_some() {
        let rule =
            "--error and --budget choose levels of points; --level and --texel those of a volume";
        bail!(Usage(rule.into()));
    }
    let block = VolumeBlock::open(pack)?;
    let camera = args.camera(block.header.bounds.map(DVec3::from_array))?;
    let finest = block.header.levels.len() as u32 - 1;
    if let Some(level) = args.level.iter().find(|l| **l > finest) {
        bail!(Usage(format!("--level {level}: the finest level of the pack is {finest}")));
    }
    let scene = VolumeScene::read(&block)?;
    let blending = match args.blend {
        BlendArg::Shares => Blending::Shares,
        BlendArg::Over => Blending::Over,
    };
    let mut details: Vec<Detail> = args.level.iter().map(|l| Detail::Level(*l)).collect();
    if details.is_empty() {
        details.push(Detail::Planes { texel: args.texel, fade: Detail::FADE });
    }
    let [min, max] = block.header.bounds.map(DVec3::from_array);
    let on_crown = CrownStyle::read(pack, style)?;
    let lit = match on_crown.is_on_crown() {
        true => on_crown.seen_from(camera.to_eye(0.5 * (min + max))),
        // It may be made of photographs, which have their light in them.
        false => Style::from(style.sampling).into(),
    };
    let mut pictures = Vec::new();
    for detail in details {
        let (picture, drawn) = scene.draw(&camera, detail, blending, lit);
        if log.says() {
            eprintln!(
                "{} cells, {} billboards, {}, coverage {:.4}",
                output::count(drawn.cells),
                output::count(drawn.billboards),
                output::bytes(drawn.bytes as u64),
                picture.mean_coverage()
            );
        }
        pictures.push(picture);
    }
    Ok(pictures)
}

impl Args {
    /// What to draw: the thresholds that were given, or the level that the table promises.
    fn levels(
        &self,
        pack: &Pack,
        block: &PointsBlock,
        camera: &Camera,
        log: Log,
    ) -> Result<Vec<Thresholds>> {
        if let Some(most) = self.budget {
            let found = within_budget(block, camera, Thresholds::LARGEST_RATIO, most);
            let (thresholds, _) = found.with_context(|| {
                format!("{}: no cut has {most} primitives or fewer", self.pack.display())
            })?;
            return Ok(vec![thresholds]);
        }
        let Some(limit) = self.error else {
            let thresholds = |&finest: &f64| Thresholds {
                finest: PixelArea(finest),
                largest: PixelArea(self.largest.unwrap_or(Thresholds::LARGEST_RATIO * finest)),
                depth_bias: PixelArea(self.bias),
            };
            return Ok(self.finest.iter().map(thresholds).collect());
        };
        let name = self.pack.display();
        let Some(table) = Measures::read(pack)? else {
            bail!(
                "{name}: has no measured table; bake it with --measure, or `forest-bake eval --embed`"
            );
        };
        let need = block.need(camera, ErrorKind::Flip);
        let Some(choice) = table.cheapest(&need, limit) else {
            let least = table.best_within(&need, f32::INFINITY).map_or(f32::NAN, |c| c.error);
            let pixels = need.pixel_height;
            bail!(
                "{name}: no measured level has FLIP {limit} at {pixels:.0} pixels; the least is {least:.4}"
            );
        };
        if log.says() {
            eprintln!(
                "chosen at {:.0} pixels: FLIP {:.4} in the worst measured view, under base colours",
                need.pixel_height, choice.error
            );
        }
        if choice.beyond {
            let (low, high) = table.heights(&need);
            log.warn(format!(
                "{name}: measured from {low} to {high} pixels: these are the figures of the nearest \
                 height and elevation"
            ));
        }
        Ok(vec![Thresholds::of_level(choice.level)])
    }

    /// A camera on the box from `min` to `max`.
    fn camera(&self, bounds: [DVec3; 2]) -> Result<Camera> {
        if let Some(d) = self.distance.filter(|d| !(d.is_finite() && *d > 0.0)) {
            return Err(Usage(format!("--distance {d}: must be positive")).into());
        }
        let wrong = || Usage(format!("--view {:?}: a name or YAW,PITCH in degrees", self.view));
        let angles = named_view(&self.view).ok_or_else(wrong)?;
        Ok(Camera::around(bounds, angles, self.distance, [self.size; 2]))
    }
}

/// All pictures side by side, written whole or not at all.
fn write(args: &Args, pictures: &[Picture]) -> Result<()> {
    let (n, side) = (pictures.len() as u32, args.size);
    let (picture, x) =
        (|x: u32| (x / side) as usize, |x: u32, y: u32| (y * side + x % side) as usize);
    let sheet: DynamicImage = if args.alpha {
        let pixels: Vec<_> = pictures.iter().map(Picture::straight).collect();
        RgbaImage::from_fn(side * n, side, |i, j| image::Rgba(pixels[picture(i)][x(i, j)])).into()
    } else {
        let pixels: Vec<_> = pictures.iter().map(|p| p.over(Picture::BACKGROUND)).collect();
        RgbImage::from_fn(side * n, side, |i, j| image::Rgb(pixels[picture(i)][x(i, j)])).into()
    };
    let mut png = Cursor::new(Vec::new());
    sheet.write_to(&mut png, ImageFormat::Png)?;
    if is_stdout(&args.output) {
        return Ok(output::print_bytes(png.get_ref())?);
    }
    output::write_file(&args.output, png.get_ref())
}

fn is_stdout(path: &Path) -> bool {
    path == Path::new("-")
}
