//! `forest-bake verify`.

use crate::log::Log;
use crate::output;
use anyhow::Result;
use forest_foliage::{CrownLight, FoliageBlock, PointsWind};
use forest_pack::header::{self, Meta};
use forest_pack::measures::Measures;
use forest_pack::{Pack, PackError, SectionId, kind};
use forest_points::{PointsBlock, read_materials};
use forest_views::ViewsBlock;
use forest_volume::VolumeBlock;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Packs to check.
    #[arg(required = true, value_name = "PACK")]
    packs: Vec<PathBuf>,
}

/// Checks all packs; the first failure decides the exit code, the others are still named.
pub(crate) fn run(args: &Args, log: Log) -> Result<()> {
    let mut first = None;
    for path in &args.packs {
        match check(path) {
            Ok(()) if !log.says() => {}
            Ok(()) => output::print(&format!("{}: ok\n", path.display()))?,
            Err(e) if first.is_none() => first = Some(e),
            Err(e) => eprintln!("forest-bake: {e}"),
        }
    }
    first.map_or(Ok(()), |e| Err(e.into()))
}

/// Every hash, header and rule of a pack.
pub(crate) fn check(path: &Path) -> Result<(), PackError> {
    let pack = Pack::open(path)?;
    pack.verify()?;
    header::decode::<Meta>(&pack, SectionId::new(kind::META, 0))?;
    Measures::read(&pack)?;
    CrownLight::read(&pack)?;
    if ViewsBlock::is_in(&pack) {
        ViewsBlock::open(&pack)?;
    }
    if VolumeBlock::is_in(&pack) {
        VolumeBlock::open(&pack)?.texels()?;
    }
    let foliage = FoliageBlock::is_in(&pack).then(|| FoliageBlock::open(&pack)).transpose()?;
    if let Some(block) = &foliage {
        block.stored()?;
        block.materials()?;
    }
    if !PointsBlock::is_in(&pack) {
        return Ok(());
    }
    let block = PointsBlock::open(&pack)?;
    if let Some(foliage) = foliage {
        PointsWind::read(&pack, &block, foliage.branches.len())?;
    }
    if !block.triangles.is_empty() {
        let (materials, _) = read_materials(&pack)?;
        let (have, want) = (materials.len(), block.header.uv_ranges.len());
        if have != want {
            let problem = format!("{have} materials; the points header has {want} ranges");
            return Err(PackError::invalid(path, SectionId::new(kind::MATERIALS, 0), problem));
        }
    }
    Ok(())
}
