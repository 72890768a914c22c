//! `forest-bake`: tree models in, LOD packs out. One file a subcommand; no algorithm here.

mod all;
mod batch;
mod capture;
mod draw;
mod eval;
mod export;
mod failure;
mod foliage;
mod inspect;
mod levels;
mod light;
mod log;
mod needs;
mod output;
mod points;
mod scene;
mod schema;
mod shell;
mod source;
mod target;
mod verify;
mod views;
mod volume;

use clap::{Parser, Subcommand};
use forest_batch::Event;
use log::{Form, Log};
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
    /// Say what takes how long.
    #[arg(short, long, global = true, conflicts_with = "quiet")]
    verbose: bool,
    /// What is told on stderr: sentences (text), or one JSON event a line (json).
    #[arg(long, global = true, value_enum, default_value = "text", hide_possible_values = true)]
    log: Form,
    /// Use this many threads (default: all cores). The result does not depend on it.
    #[arg(long, global = true, value_name = "N")]
    threads: Option<usize>,
}

#[derive(Subcommand)]
enum Command {
    /// Bake all representations with one import, by a preset.
    All(all::Args),
    /// Bake many assets as a manifest says: what has changed, several at once.
    Batch(batch::Args),

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
    /// Print the JSON schemas of what is written and read.
    Schema(schema::Args),
    /// Print completions for a shell.
    Completions(shell::CompletionsArgs),
    /// Write manual pages.
    Man(shell::ManArgs),
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
    let log = Log { form: args.log, quiet: args.quiet, verbose: args.verbose, part: false };
    match run(args, log) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let code = failure::exit_code(&error);
            match log.form {
                Form::Text => eprintln!("forest-bake: {}", failure::told(&error)),
                Form::Json => {
                    log.event(Event::Failed { error: failure::told(&error), code: Some(code) });
                }
            }
            ExitCode::from(code)
        }
    }
}

fn run(args: Args, log: Log) -> anyhow::Result<()> {
    if let Some(threads) = args.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()?;
    }
    match args.command {
        Command::All(a) => all::run(&a, log),
        Command::Batch(a) => batch::run(&a, args.threads, log),
        Command::Points(a) => points::run(&a, log),
        Command::Views(a) => views::run(&a, log),
        Command::Volume(a) => volume::run(&a, log),
        Command::Foliage(a) => foliage::run(&a, log),
        Command::Capture(a) => capture::run(&a, log),
        Command::Export(a) => export::run(&a, log),
        Command::Scene(a) => scene::run(&a, log),
        Command::Needs(a) => needs::run(&a),
        Command::Draw(a) => draw::run(&a, log),
        Command::Eval(a) => eval::run(&a, log),
        Command::Inspect(a) => inspect::run(&a),
        Command::Verify(a) => verify::run(&a, log),
        Command::Levels(a) => levels::run(&a, log),
        Command::Schema(a) => schema::run(&a),
        Command::Completions(a) => shell::completions(&a),
        Command::Man(a) => shell::man(&a),
    }
}
