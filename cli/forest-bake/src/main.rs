//! `forest-bake`: tree models in, LOD packs out. One file a subcommand; no algorithm here.

mod capture;
mod draw;
mod eval;
mod export;
mod failure;
mod foliage;
mod inspect;
mod levels;
mod light;
mod needs;
mod output;
mod points;
mod scene;
mod source;
mod target;
mod verify;
mod views;
mod volume;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Bakes tree models (glTF, OBJ) and photographs of trees into LOD packs.
///
/// Exit codes: 0 ok, 1 wrong usage, 2 input or output failed, 3 invalid input, 4 failed while
/// working, 5 the input needs something that is not supported.
#[derive(Parser)]
#[command(name = "forest-bake", version, max_term_width = 100)]
struct Args {
    #[command(subcommand)]
    command: Command,
    /// Say nothing but errors.
    #[arg(short, long, global = true)]
    quiet: bool,
    /// Use this many threads (default: all cores). The result does not depend on it.
    #[arg(long, global = true, value_name = "N")]
    threads: Option<usize>,
}

#[derive(Subcommand)]
enum Command {
    /// Bake clustered, size-sorted points.
    Points(points::Args),
    /// Bake views: pictures from many directions, in an atlas.
    Views(views::Args),
    /// Bake a volume: an octree of small billboards, from a mesh or from photographs.
    Volume(volume::Args),
    /// Bake foliage: levels of cards, sheets and tubes that bend in the wind.
    Foliage(foliage::Args),
    /// Photograph a tree from all around: RGBA images and a transforms.json.
    Capture(capture::Args),
    /// Write what engines read: views as PNG, EXR, KTX2; foliage as glb; points as PLY.
    Export(export::Args),
    /// Make a landscape of packs, or plant the trees of a scene file anew.
    Scene(scene::Args),
    /// Write packs that hold only what a scene, or a nearest distance, needs.
    Needs(needs::Args),
    /// Draw a picture of a pack, at one or several levels of detail.
    Draw(draw::Args),
    /// Judge a pack against its source: error by cost, view and distance, beside other ways.
    Eval(eval::Args),
    /// Print what is in a pack.
    Inspect(inspect::Args),
    /// Check every byte and rule of packs.
    Verify(verify::Args),
    /// Print what each radius rule and order keeps, level by level.
    Levels(levels::Args),
}

fn main() -> ExitCode {
    let args = match Args::try_parse() {
        Ok(args) => args,
        Err(error) => {
            let wrong = error.use_stderr();
            // Nothing can be done if the terminal is gone.
            let _ = error.print();
            return if wrong { failure::USAGE } else { ExitCode::SUCCESS };
        }
    };
    match run(args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("forest-bake: {error:#}");
            failure::exit_code(&error)
        }
    }
}

fn run(args: Args) -> anyhow::Result<()> {
    if let Some(threads) = args.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()?;
    }
    let quiet = args.quiet;
    match args.command {
        Command::Points(a) => points::run(&a, quiet),
        Command::Views(a) => views::run(&a, quiet),
        Command::Volume(a) => volume::run(&a, quiet),
        Command::Foliage(a) => foliage::run(&a, quiet),
        Command::Capture(a) => capture::run(&a, quiet),
        Command::Export(a) => export::run(&a, quiet),
        Command::Scene(a) => scene::run(&a, quiet),
        Command::Needs(a) => needs::run(&a),
        Command::Draw(a) => draw::run(&a, quiet),
        Command::Eval(a) => eval::run(&a, quiet),
        Command::Inspect(a) => inspect::run(&a),
        Command::Verify(a) => verify::run(&a, quiet),
        Command::Levels(a) => levels::run(&a, quiet),
    }
}
