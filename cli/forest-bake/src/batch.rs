//! `forest-bake batch`.

use crate::failure::Usage;
use crate::log::{Form, Log};
use crate::output;
use anyhow::{Context, Result, bail};
use bytesize::ByteSize;
use forest_batch::{
    Asset, BatchError, Cache, Event, Job, JobGraph, Line, Manifest, Memo, Outcome, Reason, Runner,
    State, Status, Summary, baker, worse,
};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Bake what has changed of the assets of a manifest: files and what they refer to, options, or this program.
/// Every asset is whole or as it was, whatever happens meanwhile.
///
/// Exit code 4 if an asset fails, or is worse than the baseline allows.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// The manifest (TOML; `forest-bake schema manifest`), or - for stdin.
    #[arg(value_name = "MANIFEST")]
    manifest: PathBuf,
    /// Bake these assets only.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    only: Vec<String>,
    /// Print what would be baked, and why.
    #[arg(long)]
    dry_run: bool,
    /// Bake all, changed or not.
    #[arg(long)]
    force: bool,
    /// Start nothing more after an asset has failed.
    #[arg(long)]
    fail_fast: bool,
    /// Assets at once at most; default: as many as there are cores.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    jobs: Option<u32>,
    /// Memory for all of them together, as 8GiB; default: three quarters of what is free. How much an asset
    /// needs is known from its last bake, or guessed from its size.
    #[arg(long, value_name = "BYTES")]
    max_memory: Option<ByteSize>,
    /// A folder of finished bakes that several machines may share; default: the manifest's.
    #[arg(long, value_name = "FOLDER")]
    cache: Option<PathBuf>,
    /// Write what became of all assets as JSON; - for stdout.
    #[arg(long, value_name = "FILE")]
    summary: Option<PathBuf>,
    /// Fail if bytes, counts or errors of an asset are larger than in this summary of an earlier run.
    #[arg(long, value_name = "FILE")]
    compare: Option<PathBuf>,
    /// By how much they may be larger, in per cent.
    #[arg(long, default_value_t = 1.0, value_name = "PERCENT", requires = "compare")]
    worse: f64,
    /// Print the jobs as JSON: inputs, outputs, command, hash, memory and seconds; bake nothing.
    #[arg(long, conflicts_with_all = ["dry_run", "force"])]
    jobs_json: bool,
}

pub(crate) fn run(args: &Args, threads: Option<usize>, log: Log) -> Result<()> {
    let start = Instant::now();
    let (manifest, file) = read(&args.manifest)?;
    // Before hours of work, not after.
    let baseline = args.compare.as_deref().map(read_summary).transpose()?;
    if !(args.worse >= 0.0 && args.worse.is_finite()) {
        return Err(Usage(format!("--worse {}: a share in per cent", args.worse)).into());
    }
    let assets = args.chosen(manifest.assets(&file)?)?;
    let program = std::env::current_exe().context("this program")?;
    let baker = baker(&program, env!("CARGO_PKG_VERSION"))?;
    let state = State::open(&file)?;
    let jobs = jobs(assets, &state, &baker)?;
    if args.jobs_json {
        let graph = JobGraph::new(jobs.iter(), &state, "forest-bake", &args.manifest);
        return Ok(output::print(&(serde_json::to_string_pretty(&graph)? + "\n"))?);
    }
    let reason = |job: &Job| match args.force {
        true => Some(Reason::Forced),
        false => job.reason(state.record(&job.asset.name).as_ref(), &baker),
    };
    let planned: Vec<(Job, Option<Reason>)> =
        jobs.into_iter().map(|job| (job.clone(), reason(&job))).collect();
    if args.dry_run {
        return dry_run(&planned);
    }
    let folder = args.cache.clone().or_else(|| {
        let inner = manifest.cache.as_ref()?;
        Some(file.parent().unwrap_or(Path::new("")).join(inner))
    });
    let cache = folder.map(|f| Cache::open(&f)).transpose()?;
    for (job, reason) in &planned {
        // Bakes write beside their packs.
        let folder = job.asset.output.parent().unwrap_or(Path::new("."));
        if reason.is_some() {
            std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        }
    }
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = threads.unwrap_or(cores);
    let runner = Runner {
        program,
        baker,
        jobs: args.jobs.map_or(threads, |n| n as usize),
        threads,
        memory: args.max_memory.map_or_else(usual_memory, |b| b.0),
        fail_fast: args.fail_fast,
    };
    let bar = output::bar(planned.len() as u64, "assets", log);
    let mut tell = |line: &Line| {
        log.line(line);
        bar.suspend(|| tell_people(line, log));
        if !matches!(line.event, Event::Start { .. } | Event::Stage { .. } | Event::Warning { .. })
        {
            bar.inc(1);
        }
    };
    let outcomes = runner.run(&planned, &state, cache.as_ref(), &mut tell)?;
    bar.finish_and_clear();
    let assets: Vec<&Asset> = planned.iter().map(|(job, _)| &job.asset).collect();
    let generator = concat!("forest-bake ", env!("CARGO_PKG_VERSION"));
    let summary = Summary::new(&assets, &outcomes, generator, start.elapsed().as_secs_f64());
    args.report(&summary, log)?;
    judge(&summary, &outcomes, baseline.as_ref(), args.worse)
}

impl Args {
    /// Those that are asked for.
    fn chosen(&self, all: Vec<Asset>) -> Result<Vec<Asset>> {
        for name in &self.only {
            if !all.iter().any(|a| a.name == *name) {
                let names: Vec<&str> = all.iter().map(|a| &*a.name).collect();
                let known = names.join(", ");
                return Err(
                    Usage(format!("--only {name}: no such asset; there are {known}")).into()
                );
            }
        }
        let wanted = |a: &Asset| self.only.is_empty() || self.only.contains(&a.name);
        Ok(all.into_iter().filter(wanted).collect())
    }

    fn report(&self, summary: &Summary, log: Log) -> Result<()> {
        let json = || serde_json::to_string_pretty(summary).map(|t| t + "\n");
        match self.summary.as_deref() {
            Some(path) if path == Path::new("-") => output::print(&json()?)?,
            Some(path) => output::write_file(path, json()?.as_bytes())?,
            None => {}
        }
        if log.says() {
            eprint!("{}", table(summary)?);
        }
        Ok(())
    }
}

/// The manifest, and the file that stands for it: its folder is where its paths begin.
fn read(path: &Path) -> Result<(Manifest, PathBuf)> {
    if path == Path::new("-") {
        let text = std::io::read_to_string(std::io::stdin()).context("stdin")?;
        let file = PathBuf::from("stdin.toml");
        return Ok((Manifest::parse(&text, &file)?, file));
    }
    let text = std::fs::read_to_string(path)
        .map_err(|source| BatchError::Io { file: path.into(), source })?;
    Ok((Manifest::parse(&text, path)?, path.into()))
}

fn read_summary(path: &Path) -> Result<Summary> {
    let text = std::fs::read_to_string(path)
        .map_err(|source| BatchError::Io { file: path.into(), source })?;
    let invalid =
        |problem| BatchError::Invalid { file: path.into(), element: "summary".into(), problem };
    Ok(Summary::parse(&text).map_err(invalid)?)
}

fn jobs(assets: Vec<Asset>, state: &State, baker: &str) -> Result<Vec<Job>> {
    let memo_file = state.memo();
    let mut memo = Memo::read(&memo_file);
    let trees: Vec<&[String]> = assets.iter().map(|a| &a.trees[..]).collect();
    let inputs = memo
        .inputs(&trees)
        .map_err(|(i, source)| BatchError::Sources { name: assets[i].name.clone(), source })?;
    memo.write(&memo_file)?;
    Ok(assets.into_iter().zip(inputs).map(|(a, inputs)| Job::new(a, inputs, baker)).collect())
}

fn dry_run(planned: &[(Job, Option<Reason>)]) -> Result<()> {
    let mut text = String::new();
    for (job, reason) in planned {
        if let Some(reason) = reason {
            writeln!(text, "{}: {reason}", job.asset.name)?;
        }
    }
    let count = planned.iter().filter(|p| p.1.is_some()).count();
    writeln!(text, "{count} of {} would be baked", planned.len())?;
    Ok(output::print(&text)?)
}

/// Three quarters of the memory that is free, where the system tells; else 4 GiB.
fn usual_memory() -> u64 {
    let free = || -> Option<u64> {
        let text = std::fs::read_to_string("/proc/meminfo").ok()?;
        let line = text.lines().find_map(|l| l.strip_prefix("MemAvailable:"))?;
        let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
        Some(kilobytes * 1024)
    };
    free().map_or(4 << 30, |bytes| bytes / 4 * 3)
}

fn tell_people(line: &Line, log: Log) {
    let name = line.asset.as_deref().unwrap_or_default();
    match &line.event {
        Event::Failed { error, .. } if log.form == Form::Text => eprintln!("{name}: {error}"),
        Event::Warning { text } if log.form == Form::Text => {
            log.warn(format!("{name}: {text}"));
        }
        Event::Stage { stage, seconds } if log.says() && log.verbose => {
            eprintln!("{name}: {stage} {seconds:.2} s");
        }
        Event::Done(done) if log.says() && log.verbose => {
            eprintln!("{name}: {}, {:.2} s", output::bytes(done.bytes), done.seconds);
        }
        _ => {}
    }
}

fn table(summary: &Summary) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    let width = summary.assets.iter().map(|a| a.name.chars().count()).max().unwrap_or(0).max(5);
    let shown = |a: &&forest_batch::AssetSummary| a.status != Status::Current;
    if summary.assets.iter().any(|a| shown(&a)) {
        let head = ["asset", "status", "bytes", "seconds", "memory", "errors"];
        let [asset, status, bytes, seconds, memory, errors] = head;
        writeln!(
            text,
            "{asset:width$}  {status:7}  {bytes:>11}  {seconds:>7}  {memory:>11}  {errors}"
        )?;
    }
    for a in summary.assets.iter().filter(shown) {
        write!(text, "{:width$}  {:7}", a.name, a.status.name())?;
        if let Some(done) = &a.done {
            let errors: Vec<String> =
                done.errors.iter().map(|(name, e)| format!("{name} {e:.4}")).collect();
            let memory = done.peak_bytes.map_or(String::new(), output::bytes);
            let (bytes, seconds) = (output::bytes(done.bytes), done.seconds);
            write!(text, "  {bytes:>11}  {seconds:>7.1}  {memory:>11}  {}", errors.join(", "))?;
        }
        writeln!(text)?;
    }
    let [baked, current, failed, left] =
        [Status::Baked, Status::Current, Status::Failed, Status::Left].map(|s| summary.count(s));
    write!(text, "{baked} baked, {current} up to date, {failed} failed")?;
    if left > 0 {
        write!(text, ", {left} not tried")?;
    }
    writeln!(text, ": {:.1} s", summary.seconds)?;
    Ok(text)
}

/// Whether all is well: as an error if it is not.
fn judge(
    summary: &Summary,
    outcomes: &[Outcome],
    baseline: Option<&Summary>,
    percent: f64,
) -> Result<()> {
    let failed = outcomes.iter().filter(|o| !matches!(o, Outcome::Baked(_) | Outcome::Current(_)));
    let failed = failed.count();
    let found = baseline.map(|b| worse(b, summary, percent / 100.0)).unwrap_or_default();
    let told: Vec<String> = found.iter().map(|w| format!("\n  {w}")).collect();
    match (failed, found.len()) {
        (0, 0) => Ok(()),
        (n, 0) => bail!("{n} of {} assets could not be baked", outcomes.len()),
        (0, n) => bail!("{n} measures are worse than in the baseline:{}", told.concat()),
        (n, _) => bail!(
            "{n} of {} assets could not be baked; worse than in the baseline:{}",
            outcomes.len(),
            told.concat()
        ),
    }
}
