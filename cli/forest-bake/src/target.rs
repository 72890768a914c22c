//! The pack that a bake writes over: what is there already of other representations is kept.

use crate::failure::Usage;
use anyhow::Result;
use forest_foliage::{FoliageBlock, PointsWind};
use forest_pack::header::{self, Meta};
use forest_pack::measures::Measures;
use forest_pack::{Pack, PackWriter, SectionId, kind};
use forest_points::PointsBlock;
use std::path::Path;

/// The pack that is there already, if its other representations may be kept.
pub(crate) fn existing(path: &Path, meta: &Meta, force: bool) -> Result<Option<Pack>> {
    if !path.exists() {
        return Ok(None);
    }
    let refuse =
        |why: String| Usage(format!("{}: {why}; give --force to replace it", path.display()));
    let pack = match Pack::open(path) {
        Ok(pack) => pack,
        Err(_) if force => return Ok(None),
        Err(e) => return Err(refuse(format!("exists and is not a sound pack ({e})")).into()),
    };
    let known = header::decode::<Meta>(&pack, SectionId::new(kind::META, 0));
    let same = known.is_ok_and(|m| m.source_hash == meta.source_hash);
    match (same, pack.unknown_sections().is_empty()) {
        (true, true) => Ok(Some(pack)),
        _ if force => Ok(None),
        (false, _) => Err(refuse("is a pack of another source".into()).into()),
        (true, false) => Err(refuse("has sections that this version cannot keep".into()).into()),
    }
}

/// What of a pack follows from its points and its foliage together.
const TIED: [u16; 2] = [kind::WIND_POINTS, kind::WIND_TRIANGLES];

/// Hangs the points of a finished pack on its foliage, if it has both: they bend alike in the wind.
pub(crate) fn tie(path: &Path) -> Result<()> {
    let pack = Pack::open(path)?;
    if !PointsBlock::is_in(&pack) || !FoliageBlock::is_in(&pack) {
        return Ok(());
    }
    let wind = PointsWind::new(&FoliageBlock::open(&pack)?, &PointsBlock::open(&pack)?);
    let mut writer = PackWriter::create(path)?;
    for (id, _) in pack.sections().filter(|(id, _)| !TIED.contains(&id.kind)) {
        writer.copy(&pack, id)?;
    }
    wind.write(&mut writer)?;
    writer.finish()?;
    Ok(())
}

/// Copies what `pack` holds of other representations than the one that is baked anew: sections
/// that are not `own`, and measured rows that are not of `representation`.
pub(crate) fn keep_others(
    writer: &mut PackWriter,
    pack: &Pack,
    representation: u16,
    own: impl Fn(u16) -> bool,
) -> Result<()> {
    let unties = [kind::POINTS_HEADER, kind::FOLIAGE_HEADER].contains(&representation);
    let anew = |kind: u16| {
        [kind::META, kind::MEASURES].contains(&kind) || (unties && TIED.contains(&kind))
    };
    let foreign = |kind: u16| !anew(kind) && !own(kind);
    for (id, _) in pack.sections().filter(|(id, _)| foreign(id.kind)) {
        writer.copy(pack, id)?;
    }
    // What was measured of the old ones says nothing about the new ones.
    let others = Measures::read(pack)?.map(|m| m.without(representation));
    if let Some(others) = others.filter(|m| !m.rows.is_empty()) {
        others.write(writer)?;
    }
    Ok(())
}
