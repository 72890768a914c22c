//! `make reliability`: what tests and fuzzing found out, as Markdown. Its argument is the folder of the figures.

use anyhow::{Context, Result};
use forest_tests::figures::noted;
use forest_tests::fuzz::TARGETS;
use std::path::{Path, PathBuf};

fn main() -> Result<()> {
    let folder = PathBuf::from(std::env::args().nth(1).context("usage: reliability FOLDER")?);
    let figure = |name: &str| {
        noted(&folder, name)
            .with_context(|| format!("{name} was not noted in {}", folder.display()))
    };
    println!("# What it withstands\n");
    println!(
        "`make reliability` runs the tests behind these figures at length, and writes this file. {}.\n",
        forest_eval::machine()
    );
    println!("| what | how much | test |");
    println!("|---|---|---|");
    let row =
        |what: &str, how_much: String, test: &str| println!("| {what} | {how_much} | {test} |");
    let kills = figure("kills")? + figure("kills-cache")?;
    row(
        "batches killed (SIGKILL) at random moments, with and without a cache: no file with a name was ever \
         incomplete, and after going on the bytes were those of an undisturbed run",
        format!("{kills} kills"),
        "`batch::kills::killed_at_random_points_it_loses_nothing_and_ends_with_the_same_bytes`",
    );
    row(
        "a batch with nothing to do, of 190 sound and 10 broken assets",
        format!("{:.2} s", figure("rebake-seconds")?),
        "`batch::program::two_hundred_assets_and_ten_broken_ones`",
    );
    row(
        "batches at once on one cache, most of them on one manifest: each asset in the cache once, equal bytes",
        format!("{} writers", figure("writers")?),
        "`batch::farm::two_runs_at_once_share_a_cache`",
    );
    let (refused, taken) = (figure("damaged-refused")?, figure("damaged-taken")?);
    row(
        "damaged trees, materials, pictures and packs through the program: an error that names the file and leaves \
         nothing behind, or a result",
        format!("{} files: {refused} refused, {taken} read", refused + taken),
        "`damaged::damaged_files_end_in_results_or_errors`",
    );
    let (triangles, peak) = (figure("largest-triangles")?, figure("largest-peak")?);
    row(
        "the largest single tree that was baked",
        format!("{:.1} M triangles in {:.2} GiB", triangles / 1e6, peak / f64::from(1 << 30)),
        "`make bench` (docs/BENCH.md, large blocks)",
    );
    fuzzing()
}

/// The record that `make fuzz` keeps.
fn fuzzing() -> Result<()> {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR"));
    let record = std::fs::read_to_string(tests.join("fuzz/executions.tsv"))?;
    println!("\n## Fuzzing\n");
    println!(
        "`make fuzz` (libFuzzer by cargo-fuzz, on the stable toolchain, with overflow checks and debug assertions), \
         summed over what `tests/fuzz/executions.tsv` records. What crashed was mended, and its input is part of the \
         corpus that `make test` replays.\n"
    );
    println!("| target | executions | hours | inputs that crashed | corpus |");
    println!("|---|---|---|---|---|");
    for target in &TARGETS {
        let lines = record.lines().map(|l| l.split('\t').collect::<Vec<_>>());
        let mine: Vec<_> = lines.filter(|l| l.len() == 5 && l[1] == target.name).collect();
        let sum = |column: usize| -> Result<f64> {
            mine.iter().map(|l| Ok(l[column].parse::<f64>()?)).sum()
        };
        let corpus: Vec<String> = std::fs::read_dir(tests.join("fuzz/corpus").join(target.name))?
            .map(|e| Ok(e?.file_name().to_string_lossy().into_owned()))
            .collect::<Result<_>>()?;
        let crashes = corpus.iter().filter(|name| name.starts_with("crash-")).count();
        let (executions, hours) = (sum(2)?, sum(3)? / 3600.0);
        println!("| {} | {executions} | {hours:.2} | {crashes} | {} |", target.name, corpus.len());
    }
    Ok(())
}
