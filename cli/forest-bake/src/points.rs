//! `forest-bake points`.

use crate::log::Log;
use crate::output;
use crate::source::{LoadedSource, PointsOptions, ReadSource, SourceArgs};
use crate::target;
use anyhow::{Context, Result};
use forest_pack::header::{self, Meta};
use forest_pack::{Pack, PackWriter, SectionId, kind};
use forest_points::{BakeOptions, BakeReport, Order, RadiusRule};
use forest_soup::TriangleSoup;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    source: SourceArgs,
    /// Pack to write. An existing pack of the same source keeps its other representations.
    #[arg(short, long, value_name = "PACK")]
    output: PathBuf,
    #[command(flatten)]
    options: PointsOptions,
    /// How clusters get their radius.
    #[arg(long, value_enum, default_value = "opacity")]
    radius: Radius,
    /// How arrays are sorted and cut.
    #[arg(long, value_enum, default_value = "exact")]
    order: Sorting,
    /// Leave out triangles, materials and textures.
    #[arg(long)]
    points_only: bool,
    /// Draw the pack and its source: correct the points' areas by what is seen, and write a table of
    /// errors and costs by level, height and elevation into the pack.
    #[arg(long)]
    measure: bool,
    /// Replace a pack of another source, or one with sections this version does not know.
    #[arg(long)]
    force: bool,
    /// Print counts and times as JSON on stdout.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Radius {
    /// Keep the projected area of the surfels' union: equivalent opacity.
    Opacity,
    /// Keep the sum of the surfels' projected areas.
    Area,
    /// Opaque spheres and the formula of Gilet, Meyer, Neyret 2005.
    Paper,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Sorting {
    /// By the parent's size: cuts represent every triangle exactly once.
    Exact,
    /// By the point's own size, as in the paper.
    Paper,
}

/// Triangles that are baked in memory; more go through a file beside the pack.
const IN_MEMORY: u64 = 8 << 20;

pub(crate) fn run(args: &Args, log: Log) -> Result<()> {
    let source = args.source.read(log)?;
    let is_large = source.model.triangle_count() > IN_MEMORY;
    let summary = match is_large && !args.measure {
        true => bake_large(args, source, log)?,
        false => bake(args, &source.flatten()?, log)?,
    };
    if args.json {
        output::print(&format!("{}\n", serde_json::to_string_pretty(&summary)?))?;
    }
    Ok(())
}

/// Bakes what was read.
pub(crate) fn bake(args: &Args, source: &LoadedSource, log: Log) -> Result<Summary> {
    let LoadedSource { soup, meta, trees, seconds } = source;
    let block =
        Source { meta, trees: *trees, triangles: soup.triangles.len() as u64, seconds: *seconds };
    let measured = args.measure.then_some(soup);
    write(args, &block, measured, log, |options, writer, progress| {
        Ok(forest_points::bake(soup, options, writer, progress)?)
    })
}

/// Bakes what does not fit in memory.
fn bake_large(args: &Args, source: ReadSource, log: Log) -> Result<Summary> {
    let ReadSource { model, meta, trees, max_triangles, name, seconds, .. } = source;
    let block = Source { meta: &meta, trees, triangles: model.triangle_count(), seconds };
    write(args, &block, None, log, |options, writer, progress| {
        forest_points::bake_model(model, max_triangles, options, writer, progress).context(name)
    })
}

/// What is told of a source.
struct Source<'a> {
    meta: &'a Meta,
    trees: usize,
    triangles: u64,
    /// Time of reading it.
    seconds: f64,
}

/// Writes the pack of what `make` bakes, and measures it against a soup.
fn write(
    args: &Args,
    source: &Source,
    measured_by: Option<&TriangleSoup>,
    log: Log,
    make: impl FnOnce(&BakeOptions, &mut PackWriter, &dyn Fn(u64)) -> Result<BakeReport>,
) -> Result<Summary> {
    let start = Instant::now();
    let kept = target::existing(&args.output, source.meta, args.force)?;
    let options = args.bake_options(source.trees)?;
    let measured = |p: &Pack| p.contains(SectionId::new(kind::POINTS_CALIBRATION, 0));
    if kept.as_ref().is_some_and(measured) && !args.measure {
        let name = args.output.display();
        log.warn(format!("{name}: was measured and calibrated; the new one is not (--measure)"));
    }
    // A pack that is to be measured takes its name only once it is.
    let unmeasured = if args.measure { Some(tempfile::tempdir()?) } else { None };
    let baked = match &unmeasured {
        Some(folder) => folder.path().join("unmeasured.fpack"),
        None => args.output.clone(),
    };
    let mut writer = PackWriter::create(&baked)?;
    header::write(&mut writer, SectionId::new(kind::META, 0), source.meta)?;
    let bar = output::bar(source.triangles, "points", log);
    let report = make(&options, &mut writer, &|done| bar.set_position(done))?;
    bar.finish_and_clear();
    if let Some(pack) = &kept {
        target::keep_others(&mut writer, pack, kind::POINTS_HEADER, |k| is_own(k, &options))?;
    }
    writer.finish()?;
    target::tie(&baked)?;
    if let Some(soup) = measured_by {
        crate::eval::measure(&baked, &args.output, soup, log)?;
    }
    if let Some(dropped) = report.header.counts.dropped() {
        log.warn(format!("left out triangles: {dropped}"));
    }
    let seconds = source.seconds + start.elapsed().as_secs_f64();
    let summary = Summary::new(&args.output, source, &report, seconds)?;
    if log.says() {
        summary.tell();
    }
    Ok(summary)
}

impl Args {
    /// Whether its options make sense.
    pub(crate) fn check(&self) -> Result<()> {
        self.bake_options(1).map(|_| ())
    }

    fn bake_options(&self, trees: usize) -> Result<BakeOptions> {
        Ok(BakeOptions {
            radius: match self.radius {
                Radius::Opacity => RadiusRule::Opacity,
                Radius::Area => RadiusRule::Area,
                Radius::Paper => RadiusRule::Paper,
            },
            order: match self.order {
                Sorting::Exact => Order::Exact,
                Sorting::Paper => Order::Paper,
            },
            triangles: !self.points_only,
            ..self.options.bake_options(trees)?
        })
    }
}

/// Whether a section is written by a bake of points.
fn is_own(kind: u16, options: &BakeOptions) -> bool {
    match kind {
        kind::POINTS_HEADER..=kind::POINTS_CALIBRATION => true,
        kind::MATERIALS | kind::TEXTURE => options.triangles,
        _ => false,
    }
}

/// What was done, for people and programs.
#[derive(Serialize)]
pub(crate) struct Summary {
    output: PathBuf,
    bytes: u64,
    triangles: u64,
    surfels: u64,
    points: u64,
    cells: usize,
    dropped: Dropped,
    seconds: f64,
    import_seconds: f64,
    /// From the decoded, flattened soup to the renamed pack.
    bake_seconds: f64,
    /// Seconds by stage; those of parallel stages are summed over threads.
    stage_seconds: Vec<(&'static str, f64)>,
    /// The most memory that was held at once, where the system tells.
    peak_bytes: Option<u64>,
}

#[derive(Serialize)]
struct Dropped {
    non_finite: u64,
    zero_area: u64,
    duplicate: u64,
    transparent: u64,
}

impl Summary {
    fn new(output: &Path, source: &Source, report: &BakeReport, seconds: f64) -> Result<Self> {
        let c = report.header.counts;
        Ok(Self {
            output: output.into(),
            bytes: std::fs::metadata(output)?.len(),
            triangles: c.source_triangles,
            surfels: c.surfels,
            points: c.points,
            cells: report.cells,
            dropped: Dropped {
                non_finite: c.non_finite,
                zero_area: c.zero_area,
                duplicate: c.duplicate,
                transparent: c.transparent,
            },
            seconds,
            import_seconds: source.seconds,
            bake_seconds: seconds - source.seconds,
            stage_seconds: report.times.stages().map(|(n, t)| (n, t.seconds())).to_vec(),
            peak_bytes: output::peak_bytes(),
        })
    }

    fn tell(&self) {
        eprintln!(
            "{}: {} triangles → {} surfels, {} points in {} cells, {}, {:.2} s",
            self.output.display(),
            output::count(self.triangles),
            output::count(self.surfels),
            output::count(self.points),
            self.cells,
            output::bytes(self.bytes),
            self.seconds
        );
    }
}
