//! `forest-bake export`.

use crate::failure::Usage;
use crate::log::Log;
use crate::output;
use anyhow::{Context, Result};
use forest_export::{Engine, PlainFormat, for_engine, levels, pivots, plain, splats};
use forest_foliage::FoliageBlock;
use forest_pack::Pack;
use forest_points::PointsBlock;
use forest_views::ViewsBlock;
use std::path::PathBuf;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Pack whose views, points or foliage are exported.
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
    /// Most points of a PLY file: it holds the finest cut of so many.
    #[arg(long, default_value_t = u64::MAX, hide_default_value = true, value_name = "N")]
    #[arg(value_parser = clap::value_parser!(u64).range(1..))]
    points: u64,
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

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum FormatArg {
    /// Sheets of all tiles: colour, normals, 16-bit depth, occlusion.
    Png,
    /// One linear file with all channels.
    Exr,
    /// Texture arrays with mips that keep coverage, block-compressed.
    Ktx2,
    /// Points, as Gaussian splats.
    Ply,
    /// Foliage: all levels, wind as vertex attributes; the views, if there are any, as the last level.
    Glb,
    /// Branches of foliage as textures: pivots and parents for Pivot Painter 2 materials.
    Pivots,
}

impl FormatArg {
    /// What views are written as; `None` for what is not made of views.
    fn of_views(self) -> Option<PlainFormat> {
        match self {
            Self::Png => Some(PlainFormat::Png),
            Self::Exr => Some(PlainFormat::Exr),
            Self::Ktx2 => Some(PlainFormat::Ktx2),
            Self::Ply | Self::Glb | Self::Pivots => None,
        }
    }
}

pub(crate) fn run(args: &Args, log: Log) -> Result<()> {
    let pack = Pack::open(&args.pack)?;
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
        files.extend(for_engine(&ViewsBlock::open(&pack)?, engine, &name)?);
    }
    let formats: Vec<PlainFormat> = args.format.iter().filter_map(|f| f.of_views()).collect();
    if !formats.is_empty() {
        files.extend(plain(&ViewsBlock::open(&pack)?, &formats, &name)?);
    }
    if args.format.contains(&FormatArg::Glb) {
        let views = ViewsBlock::is_in(&pack).then(|| ViewsBlock::open(&pack)).transpose()?;
        files.push(levels(&FoliageBlock::open(&pack)?, views.as_ref(), &name)?);
    }
    if args.format.contains(&FormatArg::Pivots) {
        files.extend(pivots(&FoliageBlock::open(&pack)?, &name)?);
    }
    if args.format.contains(&FormatArg::Ply) {
        let block = PointsBlock::open(&pack)?;
        let few = || Usage(format!("--points {}: the pack has no cut of so few", args.points));
        files.push(splats(&block, &name, args.points).ok_or_else(few)?);
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
        if log.says() {
            eprintln!("{}: {}", path.display(), output::bytes(file.bytes.len() as u64));
        }
    }
    Ok(())
}
