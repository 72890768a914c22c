//! `forest-bake export`.

use crate::failure::Usage;
use crate::output;
use anyhow::{Context, Result};
use forest_export::{Engine, PlainFormat, for_engine, plain};
use forest_pack::Pack;
use forest_views::ViewsBlock;
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Pack whose views are exported.
    #[arg(value_name = "PACK")]
    pack: PathBuf,
    /// Folder to write to; it is made if it is missing.
    #[arg(short, long, value_name = "FOLDER")]
    output: PathBuf,
    /// Files, channels, rows and frames as the impostor shader of this engine reads them.
    #[arg(long = "for", value_enum, value_name = "ENGINE", required_unless_present = "format")]
    engine: Option<EngineArg>,
    /// Plain files for any reader.
    #[arg(long, value_enum, value_delimiter = ',')]
    format: Vec<FormatArg>,
    /// Name of the tree in file names; default: the pack's.
    #[arg(long)]
    name: Option<String>,
    /// Replace files that are there.
    #[arg(long)]
    force: bool,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum EngineArg {
    /// Unreal Engine, ImpostorBaker's materials.
    Unreal,
    /// Godot, the octahedral impostors addon.
    Godot,
    /// three.js, octahedral-impostor.
    Three,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum FormatArg {
    /// Sheets of all tiles: colour, normals, 16-bit depth, occlusion.
    Png,
    /// One linear file with all channels.
    Exr,
    /// Texture arrays with mips that keep coverage, block-compressed.
    Ktx2,
}

impl From<FormatArg> for PlainFormat {
    fn from(f: FormatArg) -> Self {
        match f {
            FormatArg::Png => Self::Png,
            FormatArg::Exr => Self::Exr,
            FormatArg::Ktx2 => Self::Ktx2,
        }
    }
}

pub(crate) fn run(args: &Args, quiet: bool) -> Result<()> {
    let pack = Pack::open(&args.pack)?;
    let block = ViewsBlock::open(&pack)?;
    let stem = args.pack.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let name = args.name.clone().unwrap_or(stem);
    if name.is_empty() || name.contains(['/', '\\']) {
        return Err(Usage(format!("--name {name:?}: a file name without a folder")).into());
    }
    let mut files = Vec::new();
    if let Some(engine) = args.engine {
        let engine = match engine {
            EngineArg::Unreal => Engine::Unreal,
            EngineArg::Godot => Engine::Godot,
            EngineArg::Three => Engine::Three,
        };
        files.extend(for_engine(&block, engine, &name)?);
    }
    let formats: Vec<PlainFormat> = args.format.iter().map(|&f| f.into()).collect();
    if !formats.is_empty() {
        files.extend(plain(&block, &formats, &name)?);
    }
    std::fs::create_dir_all(&args.output).with_context(|| args.output.display().to_string())?;
    for file in &files {
        let path = args.output.join(&file.name);
        if path.exists() && !args.force {
            let name = path.display();
            return Err(Usage(format!("{name}: is there; give --force to replace it")).into());
        }
    }
    for file in &files {
        let path = args.output.join(&file.name);
        output::write_file(&path, &file.bytes)?;
        if !quiet {
            eprintln!("{}: {}", path.display(), output::bytes(file.bytes.len() as u64));
        }
    }
    Ok(())
}
