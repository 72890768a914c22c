//! `forest-bake eval`.

use crate::failure::Usage;
use crate::light::LightArg;
use crate::log::Log;
use crate::output;
use crate::source::{ImportArgs, LoadedSource};
use anyhow::{Context, Result};
use forest_draw::{FoliageScene, ViewsLevel, VolumeScene, read_surfaces};
use forest_eval::report::{self, Axis};
use forest_eval::{
    Baselines, Contender, Evaluation, Metric, Plan, Subject, Sweep, Truth, calibrate,
    foliage_contenders, machine, measures, own_contenders, pictures, sweep, views_contenders,
    volume_contenders,
};
use forest_foliage::FoliageBlock;
use forest_pack::header::{self, Meta};
use forest_pack::measures::Measures;
use forest_pack::{Pack, PackError, PackWriter, SectionId, kind};
use forest_points::{Calibration, PointsBlock};
use forest_raster::{Sampling, Style, Surfaces};
use forest_soup::TriangleSoup;
use forest_views::ViewsBlock;
use forest_volume::VolumeBlock;
use std::path::{Path, PathBuf};
use std::time::Instant;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Pack to judge.
    #[arg(value_name = "PACK", required_unless_present = "schema")]
    pack: Option<PathBuf>,
    /// What it was baked from: the trees of the bake, as they were given to it.
    #[arg(long, required_unless_present = "schema", num_args = 1.., value_name = "TREE")]
    source: Vec<String>,
    #[command(flatten)]
    import: ImportArgs,
    /// Sixteen views of 1024 to 4 pixels and thresholds in steps of two, instead of four views of
    /// 256 to 4 pixels: takes an hour.
    #[arg(long)]
    full: bool,
    /// Heights of the tree in pixels: the largest first, then divisors of it.
    #[arg(long, value_delimiter = ',', value_name = "PX")]
    heights: Vec<u32>,
    /// Number of held-out views.
    #[arg(long, value_name = "N")]
    views: Option<u32>,
    /// Thresholds s_m in square pixels.
    #[arg(long, value_delimiter = ',', value_name = "PX2")]
    s_m: Vec<f64>,
    /// Samples a side of a pixel, at the largest height.
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=16))]
    samples: u32,
    /// Light on the source (with shadows) and the levels (without).
    #[arg(long, value_enum, default_value = "albedo")]
    light: LightArg,
    /// Judge the pack only, without the other ways.
    #[arg(long)]
    alone: bool,
    /// Write the measured table into the pack.
    #[arg(long)]
    embed: bool,
    /// Print JSON instead of a table; `eval --schema` prints its schema.
    #[arg(long)]
    json: bool,
    /// Write one line a picture.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write a page with plots and pictures that needs no network.
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Write the plot of FLIP against primitives at the second height.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Print the JSON schema of --json and stop.
    #[arg(long)]
    schema: bool,
}

pub(crate) fn run(args: &Args, log: Log) -> Result<()> {
    if args.schema {
        return Ok(output::print(&forest_eval::json_schema())?);
    }
    let path = args.pack.as_deref().context("no pack")?;
    let plan = args.plan();
    plan.check()?;
    for (file, extension) in [(&args.csv, "csv"), (&args.html, "html"), (&args.svg, "svg")] {
        file.as_deref().map_or(Ok(()), |file| output::check_target(file, extension))?;
    }
    let start = Instant::now();
    let pack = Pack::open(path)?;
    let source = args.import.load(&args.source, log)?;
    refuse_other_source(&pack, &source)?;
    let blocks = Blocks::open(&pack)?;
    let judge = Judge::new(&source.soup, &plan, log);
    let truth = judge.truth()?;
    let drawn = Drawn::read(&pack, &blocks)?;
    let points = blocks.points.as_ref();
    let others = points.filter(|_| !args.alone);
    let baselines = others.map(|block| Baselines::new(&source.soup, block)).transpose()?;
    let of_baselines = baselines.as_ref().map(Baselines::blocks).transpose()?;
    let raw = points.and_then(Baselines::raw);
    let mut contenders = match (points, &baselines, &of_baselines) {
        (Some(points), Some(b), Some(of_baselines)) => {
            b.contenders(points, raw.as_ref(), drawn.surfaces.as_ref(), of_baselines)
        }
        (Some(points), ..) => own_contenders(points, drawn.surfaces.as_ref()),
        (None, ..) => vec![],
    };
    contenders.extend(drawn.contenders());
    let found = judge.sweep(&truth, &contenders)?;
    let exhibits = match args.html {
        Some(_) => report::gallery(&truth, &contenders, &plan, &found)?,
        None => vec![],
    };
    let table = args.embed.then(|| measures(&found, &plan));
    let subject = subject(path, &pack, points, &source, start.elapsed().as_secs_f64());
    let evaluation = Evaluation::new(subject, &plan, &contenders, found);
    let text = if args.json {
        serde_json::to_string_pretty(&evaluation)? + "\n"
    } else {
        report::text(&evaluation)?
    };
    output::print(&text)?;
    if let Some(file) = &args.csv {
        output::write_file(file, report::csv(&evaluation).as_bytes())?;
    }
    if let Some(file) = &args.html {
        output::write_file(file, report::html(&evaluation, &exhibits)?.as_bytes())?;
    }
    if let Some(file) = &args.svg {
        let height = plan.heights[1.min(plan.heights.len() - 1)];
        let svg = report::plot(&evaluation, height, Metric::Flip, Axis::Primitives)?;
        output::write_file(file, svg.as_bytes())?;
    }
    // Last: nothing of the above touches the pack if it fails.
    if let Some(table) = table {
        embed(&pack, path, &table, None)?;
        if log.says() {
            eprintln!(
                "{}: wrote {} measured rows ({})",
                path.display(),
                table.rows.len(),
                table.method
            );
        }
    }
    Ok(())
}

/// The representations of a pack.
struct Blocks<'p> {
    points: Option<PointsBlock<'p>>,
    views: Option<ViewsBlock<'p>>,
    volume: Option<VolumeBlock<'p>>,
    foliage: Option<FoliageBlock<'p>>,
}

impl<'p> Blocks<'p> {
    fn open(pack: &'p Pack) -> Result<Self, PackError> {
        let new = Self {
            points: PointsBlock::is_in(pack).then(|| PointsBlock::open(pack)).transpose()?,
            views: ViewsBlock::is_in(pack).then(|| ViewsBlock::open(pack)).transpose()?,
            volume: VolumeBlock::is_in(pack).then(|| VolumeBlock::open(pack)).transpose()?,
            foliage: FoliageBlock::is_in(pack).then(|| FoliageBlock::open(pack)).transpose()?,
        };
        if new.points.is_none()
            && new.views.is_none()
            && new.volume.is_none()
            && new.foliage.is_none()
        {
            // Says what is missing.
            PointsBlock::open(pack)?;
        }
        Ok(new)
    }
}

/// What representations are drawn from, decoded.
struct Drawn<'b> {
    surfaces: Option<Surfaces>,
    levels: Vec<ViewsLevel<'b>>,
    volume: Option<VolumeScene<'b>>,
    foliage: Option<FoliageScene<'b>>,
}

impl<'b> Drawn<'b> {
    fn read(pack: &Pack, blocks: &'b Blocks) -> Result<Self, PackError> {
        let surfaces = blocks.points.as_ref().map(|p| read_surfaces(pack, p)).transpose()?;
        let all = |views: &'b ViewsBlock| {
            (0..views.header.levels.len()).map(|level| ViewsLevel::read(views, level)).collect()
        };
        let levels = blocks.views.as_ref().map(all).transpose()?;
        Ok(Self {
            surfaces: surfaces.flatten(),
            levels: levels.unwrap_or_default(),
            volume: blocks.volume.as_ref().map(VolumeScene::read).transpose()?,
            foliage: blocks.foliage.as_ref().map(FoliageScene::read).transpose()?,
        })
    }

    /// All levels, but those of points.
    fn contenders(&'b self) -> Vec<Contender<'b>> {
        let mut all = views_contenders(&self.levels);
        all.extend(volume_contenders(self.volume.as_ref()));
        all.extend(foliage_contenders(self.foliage.as_ref()));
        all
    }
}

/// Judges all representations of `pack`, baked from `soup`, and writes the table into it.
pub(crate) fn judge(path: &Path, soup: &TriangleSoup, log: Log) -> Result<()> {
    let pack = Pack::open(path)?;
    // How levels follow each other is not asked.
    let plan = Plan { steps: 0, ..Plan::default() };
    let judge = Judge::new(soup, &plan, log);
    let truth = judge.truth()?;
    let blocks = Blocks::open(&pack)?;
    let drawn = Drawn::read(&pack, &blocks)?;
    let points = blocks.points.as_ref();
    let mut contenders =
        points.map(|p| own_contenders(p, drawn.surfaces.as_ref())).unwrap_or_default();
    contenders.extend(drawn.contenders());
    let table = measures(&judge.sweep(&truth, &contenders)?, &plan);
    embed(&pack, path, &table, None)
}

impl Args {
    fn plan(&self) -> Plan {
        let mut plan = if self.full { Plan::full() } else { Plan::default() };
        if !self.heights.is_empty() {
            plan.heights.clone_from(&self.heights);
        }
        if !self.s_m.is_empty() {
            plan.s_m.clone_from(&self.s_m);
        }
        plan.views = self.views.unwrap_or(plan.views);
        plan.sampling = Sampling { side: self.samples, ..plan.sampling };
        plan.light = self.light.light();
        plan
    }
}

/// A soup and how it is looked at.
struct Judge<'a> {
    soup: &'a TriangleSoup,
    surfaces: Surfaces,
    plan: &'a Plan,
    log: Log,
}

impl<'a> Judge<'a> {
    fn new(soup: &'a TriangleSoup, plan: &'a Plan, log: Log) -> Self {
        Self { soup, surfaces: Surfaces::new(&soup.materials, &soup.textures), plan, log }
    }

    fn truth(&self) -> Result<Truth<'_>> {
        let style = Style { sampling: self.plan.sampling, light: self.plan.light };
        Ok(Truth::new(self.soup, &self.surfaces, style)?)
    }

    fn sweep(&self, truth: &Truth, contenders: &[Contender]) -> Result<Sweep> {
        let bar = output::bar(pictures(self.plan, contenders), "pictures", self.log);
        let found = sweep(truth, contenders, self.plan, &|n| bar.set_position(n))?;
        bar.finish_and_clear();
        Ok(found)
    }
}

/// Calibrates and measures `pack`, just baked from `soup`, and writes it with both to `target`.
pub(crate) fn measure(pack: &Path, target: &Path, soup: &TriangleSoup, log: Log) -> Result<()> {
    let pack = Pack::open(pack)?;
    let mut block = PointsBlock::open(&pack)?;
    let plan = Plan { views: 9, steps: 0, ..Plan::default() };
    let judge = Judge::new(soup, &plan, log);
    let truth = judge.truth()?;
    let bar = output::bar(100, "calibration", log);
    let found = calibrate(&truth, &block, &|share| bar.set_position((100.0 * share) as u64))
        .with_context(|| target.display().to_string())?;
    bar.finish_and_clear();
    block.calibration = Some(found.calibration.clone());
    let surfaces = read_surfaces(&pack, &block)?;
    // Without depth bias: on most trees it gains nothing at equal error (docs/REPORT.md). A table
    // with it comes from `eval --embed`.
    let contenders = own_contenders(&block, surfaces.as_ref());
    let table = measures(&judge.sweep(&truth, &contenders)?, &plan);
    embed(&pack, target, &table, Some(&found.calibration))
}

/// Writes the pack to `target` with the table, whose rows replace those of the same representation
/// and light, and the calibration if there is a new one.
fn embed(
    pack: &Pack,
    target: &Path,
    table: &Measures,
    calibration: Option<&Calibration>,
) -> Result<()> {
    let mut writer = PackWriter::create(target)?;
    let replaced = |id: SectionId| {
        id.kind == kind::MEASURES || (id.kind == kind::POINTS_CALIBRATION && calibration.is_some())
    };
    for (id, _) in pack.sections().filter(|(id, _)| !replaced(*id)) {
        writer.copy(pack, id)?;
    }
    let known = Measures::read(pack)?.unwrap_or_default();
    known.merged(table).write(&mut writer)?;
    if let Some(calibration) = calibration {
        calibration.write(&mut writer)?;
    }
    Ok(writer.finish()?)
}

fn refuse_other_source(pack: &Pack, source: &LoadedSource) -> Result<()> {
    let meta: Meta = header::decode(pack, SectionId::new(kind::META, 0))?;
    if meta.source_hash == source.meta.source_hash {
        return Ok(());
    }
    let known: Vec<String> = meta
        .sources
        .iter()
        .map(|s| {
            if s.placement.is_empty() {
                s.name.clone()
            } else {
                format!("{} at {}", s.name, s.placement)
            }
        })
        .collect();
    let problem = format!(
        "was baked from another source, placement or order of trees: from {} (see `forest-bake inspect`)",
        known.join(", ")
    );
    Err(Usage(format!("{}: {problem}", pack.path().display())).into())
}

fn subject(
    path: &Path,
    pack: &Pack,
    points: Option<&PointsBlock>,
    source: &LoadedSource,
    seconds: f64,
) -> Subject {
    let name = |p: &Path| p.file_name().unwrap_or_default().to_string_lossy().into_owned();
    // Folders are nobody's business in a report that is passed on.
    let plain = |a: std::ffi::OsString| {
        let text = a.to_string_lossy().into_owned();
        if text.contains('/') { name(Path::new(&text)) } else { text }
    };
    Subject {
        generator: source.meta.generator.clone(),
        command: std::env::args_os().map(plain).collect::<Vec<_>>().join(" "),
        pack: name(path),
        pack_bytes: pack.file_length(),
        calibrated: points.is_some_and(|b| b.calibration.is_some()),
        source: source.meta.sources.iter().map(|s| s.name.clone()).collect(),
        triangles: source.soup.triangles.len() as u64,
        points: points.map_or(0, |b| b.points.len() as u64),
        machine: machine(),
        threads: rayon::current_num_threads() as u64,
        seconds,
        ..Subject::default()
    }
}
