//! `forest-view`: packs on the screen, or as pictures. The passes are those of `forest-gpu`.

mod args;
mod bench;
mod failure;
mod headless;
mod hud;
mod keys;
mod orbit;
mod output;
mod scene;
mod sequence;
mod session;
mod settings;
mod surface;
mod truth;
mod truth_worker;
mod window;

use anyhow::{Context, Result};
use args::Args;
use clap::Parser;
use failure::Usage;
use forest_gpu::Gpu;
use forest_pack::Pack;
use forest_scene::Scene;
use std::io::Write;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

fn main() -> ExitCode {
    let args = match Args::try_parse() {
        Ok(args) => args,
        Err(error) => {
            let wrong = error.use_stderr();
            // Nothing can be done if the terminal is gone.
            let _ = error.print();
            return if wrong { ExitCode::FAILURE } else { ExitCode::SUCCESS };
        }
    };
    match run(&args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("forest-view: {error:#}");
            failure::exit_code(&error)
        }
    }
}

fn run_scene(args: &Args, path: &Path) -> Result<()> {
    let start = Instant::now();
    let scene = Scene::open(path)?;
    if !args.headless && args.bench.is_none() {
        return scene::window(args, &scene);
    }
    let instance = forest_gpu::instance(args.adapter.is_some(), None);
    let gpu = Gpu::open(&instance, args.adapter.as_deref(), None)?;
    match args.bench {
        Some(_) => scene::bench(args, &gpu, &scene, start),
        None => scene::headless(args, &gpu, &scene),
    }
}

fn run(args: &Args) -> Result<()> {
    if args.list_adapters {
        let instance = forest_gpu::instance(true, None);
        for adapter in forest_gpu::adapters(&instance) {
            // A reader that has seen enough (`| head`) is no error.
            if writeln!(std::io::stdout(), "{}", forest_gpu::describe(&adapter)).is_err() {
                break;
            }
        }
        return Ok(());
    }
    let path = args.pack.as_ref().context("no pack")?;
    if scene::is_scene(path) {
        return run_scene(args, path);
    }
    // Before a device is opened: wrong packs are told as such on any machine.
    let pack = Pack::open(path)?;
    let angles = forest_soup::named_view(&args.view)
        .ok_or_else(|| Usage(format!("--view {:?}: a name or YAW,PITCH in degrees", args.view)))?;
    if args.headless || args.bench.is_some() {
        let instance = forest_gpu::instance(args.adapter.is_some(), None);
        let gpu = Gpu::open(&instance, args.adapter.as_deref(), None)?;
        return match args.bench {
            Some(_) => bench::run(args, &gpu, &pack),
            None => headless::run(args, &gpu, &pack, angles),
        };
    }
    drop(pack);
    window::run(args, path, angles)
}
