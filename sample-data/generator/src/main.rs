//! `forest-sample-data`: writes a tree as glb, gltf or obj.

use anyhow::{Result, bail};
use clap::Parser;
use forest_sample_data::{Species, grow, write_glb, write_gltf, write_obj};
use std::path::PathBuf;

/// Grows a tree of our own and writes it.
#[derive(Parser)]
#[command(version)]
struct Args {
    /// Kind of tree.
    #[arg(long, value_enum)]
    species: Species,
    /// Seed: the same seed gives the same tree.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// About how many triangles.
    #[arg(long, default_value_t = 20_000)]
    triangles: u64,
    /// File to write: .glb, .gltf or .obj.
    #[arg(short)]
    output: PathBuf,
}

fn main() -> Result<()> {
    let args = Args::parse();
    let model = grow(args.species, args.seed, args.triangles);
    match args.output.extension().and_then(|e| e.to_str()) {
        Some("glb") => write_glb(&model, &args.output)?,
        Some("gltf") => write_gltf(&model, &args.output)?,
        Some("obj") => write_obj(&model, &args.output)?,
        _ => bail!("{}: the name must end in .glb, .gltf or .obj", args.output.display()),
    }
    println!("{}: {} triangles", args.output.display(), model.triangle_count());
    Ok(())
}
