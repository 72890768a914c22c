//! `forest-bake views`.

use crate::failure::Usage;
use crate::log::Log;
use crate::output;
use crate::source::{LoadedSource, SourceArgs};
use crate::target;
use anyhow::Result;
use forest_draw::PointsSubject;
use forest_export::contact_sheet;
use forest_pack::{Pack, PackWriter, SectionId, header, kind};
use forest_points::{BakeOptions, PointsBlock, SurfelSize};
use forest_raster::{Buffers, CaptureScene, Subject, Surfaces};
use forest_soup::TriangleSoup;
use forest_views::{
    BakeReport, Channels, Directions, Dome, Fit, Frame, Layout, Quality, ViewsBlock, ViewsError,
    ViewsOptions,
};
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    source: SourceArgs,
    /// Pack to write. An existing pack of the same source keeps its other representations.
    #[arg(short, long, value_name = "PACK")]
    output: PathBuf,
    /// Write a sheet of all views, for people.
    #[arg(long, value_name = "PNG")]
    preview: Option<PathBuf>,
    /// octahedral (as many of N×N as --views allows), octahedral:N, rings, or rings:RxP for R rings
    /// of P views and one at the pole.
    #[arg(long, default_value = "octahedral", value_name = "LAYOUT")]
    layout: String,
    /// Most views.
    #[arg(long, default_value_t = 300, value_parser = clap::value_parser!(u32).range(4..=16384))]
    views: u32,
    /// Views from below the horizon too.
    #[arg(long)]
    full_sphere: bool,
    /// Texels along the side of a view: a power of two.
    #[arg(long, default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..=4096))]
    texels: u32,
    /// Samples along the side of a texel, at least.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=16))]
    samples: u32,
    /// What to store beside colour and coverage.
    #[arg(long, value_enum, value_delimiter = ',', default_value = "color,normal,depth,ao")]
    channels: Vec<ChannelArg>,
    /// How texels are stored.
    #[arg(long, value_enum, default_value = "gpu")]
    quality: QualityArg,
    /// How views are framed.
    #[arg(long, value_enum, default_value = "tight")]
    fit: FitArg,
    /// What to draw views from: triangles, or points no wider than half a texel.
    #[arg(long, value_enum, default_value = "auto")]
    detail: Detail,
    /// Longest side of an atlas page; what does not fit goes to further pages.
    #[arg(long, default_value_t = 4096, value_name = "TEXELS")]
    max_page: u32,
    /// Replace a pack of another source, or one with sections this version does not know.
    #[arg(long)]
    force: bool,
    /// Print counts and times as JSON on stdout.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum ChannelArg {
    /// Base colour and coverage; always stored.
    Color,
    /// Normals.
    Normal,
    /// Depth, for depth-corrected look-up.
    Depth,
    /// Share of the sky that is seen.
    Ao,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Detail {
    /// Points if there are far more triangles than texels, and a trial shows that they look the same.
    Auto,
    /// All triangles.
    Triangles,
    /// Points, baked for it; without occlusion.
    Points,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum QualityArg {
    /// BC7, BC5 and BC4, as a GPU reads them.
    Gpu,
    /// 8 bits a channel, 16 of depth.
    Lossless,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum FitArg {
    /// The smallest square that holds the tree in every view.
    Tight,
    /// The square about the sphere around the tree's box.
    Sphere,
}

pub(crate) fn run(args: &Args, log: Log) -> Result<()> {
    args.check()?;
    if let Some(preview) = &args.preview {
        output::check_target(preview, "png")?;
    }
    let source = args.source.load(log)?;
    let summary = bake(args, &source, log)?;
    if args.json {
        output::print(&format!("{}\n", serde_json::to_string_pretty(&summary)?))?;
    }
    Ok(())
}

/// Bakes what was read.
pub(crate) fn bake(args: &Args, source: &LoadedSource, log: Log) -> Result<Summary> {
    let start = Instant::now();
    let options = args.options()?;
    source.soup.validate()?;
    let kept = target::existing(&args.output, &source.meta, args.force)?;
    let frame = Frame::of(&source.soup, &options.directions, options.fit);
    let frame = frame.ok_or(ViewsError::NothingToSee)?;
    let prepare = Instant::now();
    let surfaces = Surfaces::new(&source.soup.materials, &source.soup.textures);
    let mut scene = CaptureScene::new(&source.soup, &surfaces);
    let points = args.points(&source.soup, &scene, &frame, &options, log)?;
    let points = points.as_ref().map(PointsBlock::open).transpose()?;
    let prepare = prepare.elapsed().as_secs_f64();
    let sky = Instant::now();
    if options.channels.sky {
        scene = scene.with_skylight();
    }
    let sky = sky.elapsed().as_secs_f64();
    let cut = points.as_ref().map(PointsSubject::new);
    let subject: &dyn Subject = cut.as_ref().map_or(&scene as &dyn Subject, |c| c);
    let mut writer = PackWriter::create(&args.output)?;
    header::write(&mut writer, SectionId::new(kind::META, 0), &source.meta)?;
    let bar = output::bar(u64::from(options.directions.count()), "views", log);
    let report =
        forest_views::bake(subject, &frame, &options, &mut writer, &|n| bar.set_position(n))?;
    bar.finish_and_clear();
    if let Some(pack) = &kept {
        let own = |kind| (kind::VIEWS_HEADER..=kind::VIEWS_SKY).contains(&kind);
        target::keep_others(&mut writer, pack, kind::VIEWS_HEADER, own)?;
    }
    writer.finish()?;
    if let Some(preview) = &args.preview {
        let pack = Pack::open(&args.output)?;
        output::write_file(preview, &contact_sheet(&ViewsBlock::open(&pack)?)?)?;
    }
    let seconds = source.seconds + start.elapsed().as_secs_f64();
    let summary = Summary::new(args, &report, [source.seconds, prepare, sky, seconds])?;
    if log.says() {
        summary.tell();
    }
    Ok(summary)
}

/// Triangles for each texel of a tile from which points are tried.
const TRIANGLES_A_TEXEL: f64 = 64.0;

/// Largest root mean square difference of premultiplied colour and coverage at which points pass
/// for triangles, and of the mean coverage.
const SAME_RMSE: f64 = 0.03;
const SAME_COVERAGE: f64 = 0.02;

impl Args {
    /// Whether its options make sense.
    pub(crate) fn check(&self) -> Result<()> {
        self.options().map(|_| ())
    }

    /// The pack of points to capture instead of the triangles, if there should be one.
    fn points(
        &self,
        soup: &TriangleSoup,
        scene: &CaptureScene,
        frame: &Frame,
        options: &ViewsOptions,
        log: Log,
    ) -> Result<Option<Pack>> {
        let texels = f64::from(self.texels).powi(2);
        let many = soup.triangles.len() as f64 > TRIANGLES_A_TEXEL * texels;
        // Points know nothing of the sky.
        let wanted = match self.detail {
            Detail::Triangles => false,
            Detail::Auto => many && !options.channels.sky,
            Detail::Points if options.channels.sky => {
                let rule = "leave ao out of --channels, or take --detail triangles";
                return Err(Usage(format!("--detail points has no occlusion: {rule}")).into());
            }
            Detail::Points => true,
        };
        if !wanted {
            return Ok(None);
        }
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("points.fpack");
        let mut writer = PackWriter::create(&path)?;
        // Finer than a quarter of a texel is never drawn.
        let size = 2.0 * frame.half / f64::from(self.texels) / 4.0;
        let points = BakeOptions {
            surfel_size: SurfelSize::Units(size),
            triangles: false,
            ..BakeOptions::default()
        };
        forest_points::bake(soup, &points, &mut writer, &|_| {})?;
        writer.finish()?;
        // The map outlives the file's name.
        let pack = Pack::open(&path)?;
        if self.detail == Detail::Auto {
            let block = PointsBlock::open(&pack)?;
            let subject = PointsSubject::new(&block);
            let [rmse, coverage] = difference(&subject, scene, frame, options);
            if log.says() {
                eprintln!("points instead of triangles: RMSE {rmse:.4}, coverage {coverage:+.4}");
            }
            if rmse > SAME_RMSE || coverage.abs() > SAME_COVERAGE {
                return Ok(None);
            }
        }
        Ok(Some(pack))
    }

    fn options(&self) -> Result<ViewsOptions> {
        let dome = if self.full_sphere { Dome::Full } else { Dome::Upper };
        let wrong = || {
            let text = &self.layout;
            Usage(format!("--layout {text:?}: octahedral, octahedral:N, rings or rings:RxP"))
        };
        let number = |text: &str| text.parse::<u32>().map_err(|_| wrong());
        let directions = match self.layout.split_once(':') {
            None if self.layout == "octahedral" => Directions::octahedral(self.views, dome),
            None if self.layout == "rings" => Directions::rings(self.views, dome),
            Some(("octahedral", side)) => {
                Directions { layout: Layout::Octahedral { side: number(side)? }, dome }
            }
            Some(("rings", size)) => {
                let (rings, points) = size.split_once('x').ok_or_else(wrong)?;
                let layout = Layout::Rings { rings: number(rings)?, points: number(points)? };
                Directions { layout, dome }
            }
            _ => return Err(wrong().into()),
        };
        let has = |c| self.channels.contains(&c);
        let options = ViewsOptions {
            directions,
            texels: self.texels,
            samples: self.samples,
            channels: Channels {
                normal: has(ChannelArg::Normal),
                depth: has(ChannelArg::Depth),
                sky: has(ChannelArg::Ao),
            },
            quality: match self.quality {
                QualityArg::Gpu => Quality::Block,
                QualityArg::Lossless => Quality::Lossless,
            },
            fit: match self.fit {
                FitArg::Tight => Fit::Tight,
                FitArg::Sphere => Fit::Sphere,
            },
            max_page: self.max_page,
        };
        options.validate().map_err(Usage)?;
        Ok(options)
    }
}

/// Root mean square difference of two subjects' captures over three views, and the relative one of
/// their mean coverage.
fn difference(a: &dyn Subject, b: &dyn Subject, frame: &Frame, options: &ViewsOptions) -> [f64; 2] {
    let (mut square, mut n, mut covered) = (0.0, 0.0, [0.0; 2]);
    for i in [0, 1, 2] {
        let from = options.directions.direction(i * (options.directions.count() - 1) / 2);
        let camera = frame.camera(from, options.texels);
        let [a, b] = [a, b].map(|s| s.capture(&camera, 16, &mut Buffers::default()).picture);
        covered = [covered[0] + a.mean_coverage(), covered[1] + b.mean_coverage()];
        for (p, q) in a.pixels.iter().zip(&b.pixels).filter(|(p, q)| p[3] + q[3] > 0.0) {
            square += (0..4).map(|k| f64::from(p[k] - q[k]).powi(2)).sum::<f64>() / 4.0;
            n += 1.0;
        }
    }
    [f64::sqrt(square / f64::max(n, 1.0)), covered[0] / covered[1].max(1e-9) - 1.0]
}

/// What was done, for people and programs.
#[derive(Serialize)]
pub(crate) struct Summary {
    output: PathBuf,
    bytes: u64,
    views: u32,
    texels: u32,
    levels: usize,
    pages: u32,
    /// Bytes of all channels and levels.
    view_bytes: u64,
    /// Of the texels of whole tiles, those that are stored.
    stored_share: f64,
    /// Of the texels of whole tiles, those that show something.
    seen_share: f64,
    /// Of the texels of the pages, those between tiles.
    page_waste: f64,
    /// Tiles about the sphere of the tree's box would have this many times the area.
    sphere_area: f64,
    seconds: f64,
    import_seconds: f64,
    /// Sorting and shading triangles.
    prepare_seconds: f64,
    /// Measuring the sky that triangles see.
    sky_seconds: f64,
    /// Capturing views and filtering them to levels.
    capture_seconds: f64,
    /// Of that, filtering: a share of the threads' time.
    filter_share: f64,
    /// Packing, encoding and writing.
    encode_seconds: f64,
}

impl Summary {
    fn new(args: &Args, r: &BakeReport, [import, prepare, sky, all]: [f64; 4]) -> Result<Self> {
        let h = &r.header;
        let share = |a: u64, b: u64| a as f64 / b.max(1) as f64;
        Ok(Self {
            output: args.output.clone(),
            bytes: std::fs::metadata(&args.output)?.len(),
            views: h.directions.count(),
            texels: h.levels[0].texels,
            levels: h.levels.len(),
            pages: h.levels[0].pages,
            view_bytes: r.bytes,
            stored_share: share(r.texels.stored, r.texels.tiles),
            seen_share: share(r.texels.seen, r.texels.tiles),
            page_waste: 1.0 - share(r.texels.stored, r.texels.pages),
            sphere_area: (r.sphere / h.half).powi(2),
            seconds: all,
            import_seconds: import,
            prepare_seconds: prepare,
            sky_seconds: sky,
            capture_seconds: r.capture.as_secs_f64(),
            filter_share: r.filter_share,
            encode_seconds: r.encode.as_secs_f64(),
        })
    }

    fn tell(&self) {
        eprintln!(
            "{}: {} views of {}² texels, {} levels, {} page(s), {}: {:.2} s \
             (capture {:.2}, sky {:.2}, encode {:.2})",
            self.output.display(),
            self.views,
            self.texels,
            self.levels,
            self.pages,
            output::bytes(self.view_bytes),
            self.seconds,
            self.capture_seconds,
            self.sky_seconds,
            self.encode_seconds,
        );
        eprintln!(
            "of whole tiles {:.1} % is stored, {:.1} % shows something; pages waste {:.1} %; tiles \
             about the sphere would be {:.2} times as large",
            100.0 * self.stored_share,
            100.0 * self.seen_share,
            100.0 * self.page_waste,
            self.sphere_area,
        );
    }
}
