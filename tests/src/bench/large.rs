//! Blocks that do not fit in memory: memory against triangles.

use anyhow::{Context, Result};
use forest_tests::{figures, reports};
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;

/// Triangles of the tree that blocks are made of, and how many of it stand in them.
const TREE: u64 = 200_000;
const TREES: [u64; 5] = [5, 20, 40, 63, 250];

/// Triangles of one tree in a file of its own.
const SINGLE: u64 = 50_000_000;

/// What `forest-bake points` said of a block.
struct Large {
    name: String,
    triangles: u64,
    points: u64,
    seconds: f64,
    peak: f64,
    pack: f64,
}

/// Prints the table.
pub(crate) fn report() -> Result<()> {
    println!("\n## Large blocks\n");
    println!(
        "The whole program, `forest-bake points` with default options: blocks of broadleaf trees of {TREE} \
         triangles, and one file of a single tree. Above 8,388,608 triangles the bake works cell by cell from \
         disk. The peak is of the whole process, mapped files included.\n"
    );
    println!(
        "| block | triangles | points | s | M triangles/s | peak, MiB | bytes a triangle at the peak | pack, MiB |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    // Beside the programs: the folder for temporary files may be memory.
    let dir = tempfile::tempdir_in(std::env::current_exe()?.parent().context("a folder")?)?;
    let tree = grown(dir.path(), "tree.glb", TREE)?;
    for trees in TREES {
        let block = dir.path().join("block.toml");
        std::fs::write(&block, placed(&tree, trees))?;
        tell(&baked(dir.path(), &block, format!("{trees} trees"))?);
    }
    let single = grown(dir.path(), "single.glb", SINGLE)?;
    let one = baked(dir.path(), Path::new(&single), "one tree".into())?;
    tell(&one);
    figures::note("largest-triangles", one.triangles as f64);
    figures::note("largest-peak", one.peak);
    Ok(())
}

fn tell(l: &Large) {
    let mebi = f64::from(1 << 20);
    println!(
        "| {} | {} | {} | {:.1} | {:.2} | {:.0} | {:.0} | {:.0} |",
        l.name,
        l.triangles,
        l.points,
        l.seconds,
        l.triangles as f64 / l.seconds / 1e6,
        l.peak / mebi,
        l.peak / l.triangles as f64,
        l.pack / mebi
    );
}

/// Grows a tree by the program that makes the samples.
fn grown(dir: &Path, name: &str, triangles: u64) -> Result<String> {
    let file = dir.join(name).to_string_lossy().into_owned();
    let n = triangles.to_string();
    let args = ["--species", "broadleaf", "--seed", "1", "--triangles", &n, "-o", &file];
    reports::program_named("forest-sample-data", &args)?;
    Ok(file)
}

/// A block of trees in rows, each turned another way.
fn placed(tree: &str, trees: u64) -> String {
    let side = (trees as f64).sqrt().ceil() as u64;
    let mut text = String::new();
    for i in 0..trees {
        let (x, z, yaw) = (7 * (i % side), 7 * (i / side), i * 137 % 360);
        let _ = writeln!(text, "[[tree]]\nfile = {tree:?}\nat = [{x}, 0, {z}]\nyaw = {yaw}");
    }
    text
}

fn baked(dir: &Path, block: &Path, name: String) -> Result<Large> {
    let pack = dir.join("large.fpack");
    let (block, output) = (block.to_string_lossy(), pack.to_string_lossy());
    let args =
        ["points", &block, "-o", &output, "--force", "--json", "-q", "--max-triangles", "60000000"];
    let said: Value = serde_json::from_slice(&reports::program(&args)?)?;
    std::fs::remove_file(&pack)?;
    let number = |key: &str| said[key].as_f64().with_context(|| format!("no {key}"));
    Ok(Large {
        name,
        triangles: number("triangles")? as u64,
        points: number("points")? as u64,
        seconds: number("seconds")?,
        peak: number("peak_bytes")?,
        pack: number("bytes")?,
    })
}
