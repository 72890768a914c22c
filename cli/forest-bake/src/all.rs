//! `forest-bake all`: every representation with one import.

mod preset;
mod work;

use crate::failure::Usage;
use crate::log::Log;
use crate::source::{ImportArgs, LoadedSource};
use crate::volume::{Loaded, is_capture};
use crate::{eval, export, foliage, needs, output, points, views, volume};
use anyhow::{Context, Result};
use clap::Parser;
use forest_batch::{Done, Event};
use forest_foliage::FoliageError;
use forest_pack::measures::Measures;
use forest_pack::{Pack, kind};
pub(crate) use preset::Preset;
use preset::{Representation, Setting};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;
use work::Work;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Trees, as `points` takes them, or one capture, as `volume` takes it.
    #[arg(required = true, value_name = "TREE")]
    trees: Vec<String>,
    #[command(flatten)]
    import: ImportArgs,
    /// Pack to write.
    #[arg(short, long, value_name = "PACK")]
    output: PathBuf,
    /// What is baked, and how finely (`inspect --presets` prints them).
    #[arg(long, value_enum, default_value = "game")]
    preset: Preset,
    /// Representations, instead of the preset's.
    #[arg(long = "with", value_enum, value_delimiter = ',', value_name = "REPRESENTATION")]
    representations: Vec<Representation>,
    /// An option of a representation's own command, as views.texels=512; it counts before the preset's.
    #[arg(long = "set", value_name = "REPRESENTATION.OPTION=VALUE")]
    settings: Vec<Setting>,
    /// Judge every representation against the source, and write the table of errors into the pack.
    #[arg(long)]
    judge: bool,
    /// Keep only what is drawn from this distance on, as 3m.
    #[arg(long, value_name = "DISTANCE")]
    nearest: Option<String>,
    /// What to export beside the pack: png, exr, ktx2, ply, glb, pivots, unreal, godot, three.
    #[arg(long, value_delimiter = ',', value_name = "FORMAT", requires = "export_to")]
    export: Vec<String>,
    /// Folder of the exports.
    #[arg(long, value_name = "FOLDER")]
    export_to: Option<PathBuf>,
    /// Name of the tree in the names of exports; default: the pack's.
    #[arg(long)]
    name: Option<String>,
    /// Replace what is there.
    #[arg(long)]
    force: bool,
    /// Print what was made as JSON on stdout.
    #[arg(long)]
    json: bool,
    /// Stop when stdin ends: whoever started this is gone.
    #[arg(long, hide = true)]
    until_stdin_ends: bool,
}

pub(crate) fn run(args: &Args, log: Log) -> Result<()> {
    if args.until_stdin_ends {
        work::stop_when_stdin_ends();
    }
    let start = Instant::now();
    output::check_target(&args.output, "fpack")?;
    if args.output.exists() && !args.force {
        let name = args.output.display();
        return Err(Usage(format!("{name}: is there; give --force to replace it")).into());
    }
    let work = Work::beside(&args.output)?;
    let bakes = args.bakes(&work.pack())?;
    log.event(Event::Start { sources: args.trees.clone(), output: args.output.clone() });
    let mut done = Done::default();
    match &args.trees[..] {
        [capture] if is_capture(capture) => args.bake_capture(&bakes, log, &mut done)?,
        trees => args.bake_trees(&bakes, &work, log, &mut done).with_context(|| trees.join(" "))?,
    }
    if let Some(nearest) = &args.nearest {
        let stage = Instant::now();
        let line = [work.pack(), "-o".into(), work.pruned(), "--nearest".into(), nearest.into()];
        match parse("needs", line.iter().map(|p| p.display().to_string()))? {
            crate::Command::Needs(args) => needs::keep(&args)?,
            _ => unreachable!("the command that was named"),
        }
        std::fs::rename(work.pruned().join(work::PACK), work.pack())?;
        log.stage("needs", stage.elapsed().as_secs_f64());
    }
    if !args.export.is_empty() {
        let stage = Instant::now();
        export::run(&args.exports(&work)?, log.for_part())?;
        log.stage("export", stage.elapsed().as_secs_f64());
    }
    errors(&work.pack(), &mut done)?;
    done.bytes = std::fs::metadata(work.pack())?.len();
    done.exports = work.install(args.export_to.as_deref(), &args.output)?;
    done.output = args.output.clone();
    done.seconds = start.elapsed().as_secs_f64();
    done.peak_bytes = output::peak_bytes();
    if log.says() {
        let (name, bytes) = (done.output.display(), output::bytes(done.bytes));
        eprintln!("{name}: {bytes}, {} exports, {:.2} s", done.exports.len(), done.seconds);
    }
    if args.json {
        output::print(&format!("{}\n", serde_json::to_string_pretty(&done)?))?;
    }
    log.event(Event::Done(done));
    Ok(())
}

/// A representation to be baked, by its own command.
struct Bake {
    command: crate::Command,
    name: &'static str,
    /// Asked for by name: it must succeed.
    asked: bool,
}

impl Args {
    /// The commands of all representations, parsed as their own command lines are.
    fn bakes(&self, pack: &Path) -> Result<Vec<Bake>> {
        let only_capture = matches!(&self.trees[..], [one] if is_capture(one));
        let asked = !self.representations.is_empty();
        let which = match (asked, only_capture) {
            (true, _) => &self.representations[..],
            (false, true) => &[Representation::Volume],
            (false, false) => self.preset.representations(),
        };
        if only_capture && which != [Representation::Volume] {
            return Err(Usage("of a capture a volume is made, and nothing else".into()).into());
        }
        for s in &self.settings {
            if !which.contains(&s.representation) {
                let name = s.representation.name();
                return Err(Usage(format!("--set {name}.{}: no {name} is baked", s.option)).into());
            }
        }
        let bake = |r: &Representation| {
            let own = self.settings.iter().filter(|s| s.representation == *r);
            let mut line = self.trees.clone();
            line.extend(["-o".to_string(), pack.display().to_string(), "--force".into()]);
            line.extend(preset::options(self.preset, *r, own));
            let command = parse(r.name(), line.into_iter())?;
            // Before the work, not after half of it.
            match &command {
                crate::Command::Points(a) => a.check()?,
                crate::Command::Views(a) => a.check()?,
                crate::Command::Volume(a) => a.check()?,
                crate::Command::Foliage(a) => a.check()?,
                _ => {}
            }
            Ok(Bake { command, name: r.name(), asked })
        };
        which.iter().map(bake).collect()
    }

    fn bake_capture(&self, bakes: &[Bake], log: Log, done: &mut Done) -> Result<()> {
        for bake in bakes {
            if let crate::Command::Volume(args) = &bake.command {
                let mut loaded = args.load(log)?;
                loaded.meta_mut().options = self.told();
                let stage = Instant::now();
                counts(bake.name, &volume::bake(args, &loaded, log.for_part())?, done)?;
                log.stage(bake.name, stage.elapsed().as_secs_f64());
            }
        }
        Ok(())
    }

    fn bake_trees(&self, bakes: &[Bake], work: &Work, log: Log, done: &mut Done) -> Result<()> {
        let mut source = self.import.load(&self.trees, log)?;
        source.meta.options = self.told();
        log.stage("import", source.seconds);
        // Volumes take either source.
        let mut loaded = Loaded::Mesh(Box::new(source));
        let part = log.for_part();
        for bake in bakes {
            let stage = Instant::now();
            let Loaded::Mesh(source) = &mut loaded else { continue };
            match &bake.command {
                crate::Command::Points(a) => {
                    counts(bake.name, &points::bake(a, source, part)?, done)?
                }
                crate::Command::Views(a) => {
                    counts(bake.name, &views::bake(a, source, part)?, done)?
                }
                crate::Command::Foliage(a) => match foliage::bake(a, source, part) {
                    Ok(made) => counts(bake.name, &made, done)?,
                    Err(e) if !bake.asked && has_no_leaves(&e) => {
                        log.warn(format!("no foliage is baked: {e:#}"));
                    }
                    Err(e) => return Err(e),
                },
                crate::Command::Volume(a) => {
                    counts(bake.name, &volume::bake(a, &loaded, part)?, done)?;
                }
                _ => {}
            }
            log.stage(bake.name, stage.elapsed().as_secs_f64());
        }
        if let (true, Loaded::Mesh(source)) = (self.judge, &loaded) {
            let stage = Instant::now();
            self.judge(source, work, log)?;
            log.stage("judge", stage.elapsed().as_secs_f64());
        }
        Ok(())
    }

    fn judge(&self, source: &LoadedSource, work: &Work, log: Log) -> Result<()> {
        eval::judge(&work.pack(), &source.soup, log.for_part())
    }

    /// What the pack says of how it was baked.
    fn told(&self) -> Vec<String> {
        let mut out = vec![format!("--preset={}", self.preset.name())];
        if !self.representations.is_empty() {
            let names: Vec<&str> = self.representations.iter().map(|r| r.name()).collect();
            out.push(format!("--with={}", names.join(",")));
        }
        out.extend(self.settings.iter().map(|s| format!("--set={s}")));
        out.extend(self.judge.then(|| "--judge".into()));
        out.extend(self.nearest.iter().map(|n| format!("--nearest={n}")));
        out
    }

    fn exports(&self, work: &Work) -> Result<export::Args> {
        let stem = self.output.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let name = self.name.clone().unwrap_or(stem);
        let (engines, formats): (Vec<&String>, Vec<&String>) =
            self.export.iter().partition(|e| ["unreal", "godot", "three"].contains(&e.as_str()));
        let mut line = vec![work.pack().display().to_string()];
        line.extend(["-o".to_string(), work.exports().display().to_string()]);
        line.push(format!("--name={name}"));
        line.extend(engines.iter().map(|e| format!("--for={e}")));
        line.extend(formats.iter().map(|f| format!("--format={f}")));
        match parse("export", line.into_iter())? {
            crate::Command::Export(args) => Ok(args),
            _ => unreachable!("the command that was named"),
        }
    }
}

/// A command of this program, from its arguments; what is wrong with them is told without usage and hints.
fn parse(name: &str, arguments: impl Iterator<Item = String>) -> Result<crate::Command> {
    let line = ["forest-bake".to_string(), name.into()].into_iter().chain(arguments);
    let parsed = crate::Args::try_parse_from(line).map_err(|e| {
        let text = e.to_string();
        let first = text.lines().next().unwrap_or_default();
        Usage(format!("{name}: {}", first.trim_start_matches("error: ")))
    })?;
    Ok(parsed.command)
}

fn has_no_leaves(error: &anyhow::Error) -> bool {
    let none = |c: &FoliageError| matches!(c, FoliageError::NoLeaves { .. });
    error.chain().filter_map(|c| c.downcast_ref()).any(none)
}

/// Numbers of a summary that say how much there is: the less, the cheaper.
const COUNTS: [&str; 6] = ["triangles", "points", "cells", "views", "billboards", "leaves"];

/// Keeps what a bake says of how much there is, and of errors.
fn counts(name: &str, summary: &impl serde::Serialize, done: &mut Done) -> Result<()> {
    let value = serde_json::to_value(summary)?;
    for key in COUNTS {
        if let Some(n) = value[key].as_u64() {
            done.counts.insert(format!("{name}.{key}"), n);
        }
    }
    if let (Some(levels), "foliage") = (value["levels"].as_array(), name) {
        for (i, level) in levels.iter().enumerate() {
            if let Some(n) = level["triangles"].as_u64() {
                done.counts.insert(format!("{name}.level{i}.triangles"), n);
            }
        }
    }
    if let Some(e) = value["delta_e"].as_f64() {
        done.errors.insert(format!("{name}.delta_e"), e);
    }
    Ok(())
}

/// Keeps what a pack's table says: of each representation and height the least mean FLIP of its levels, and of
/// those the mean over the heights.
fn errors(pack: &Path, done: &mut Done) -> Result<()> {
    let pack = Pack::open(pack)?;
    let Some(table) = Measures::read(&pack)? else { return Ok(()) };
    let mut least: BTreeMap<(u16, u32), f32> = BTreeMap::new();
    for row in &table.rows {
        let at =
            least.entry((row.representation, row.pixel_height as u32)).or_insert(f32::INFINITY);
        *at = at.min(row.flip);
    }
    let all = [
        (kind::POINTS_HEADER, "points"),
        (kind::VIEWS_HEADER, "views"),
        (kind::VOLUME_HEADER, "volume"),
        (kind::FOLIAGE_HEADER, "foliage"),
    ];
    for (representation, name) in all {
        let own = least.iter().filter(|((r, _), _)| *r == representation);
        let found: Vec<f64> = own.map(|(_, flip)| f64::from(*flip)).collect();
        if !found.is_empty() {
            let mean = found.iter().sum::<f64>() / found.len() as f64;
            done.errors.insert(format!("{name}.flip"), mean);
        }
    }
    Ok(())
}
