//! Packs that hold only the levels and channels of views that are drawn.

use crate::bake::section_kind;
use crate::block::ViewsBlock;
use crate::codec::Channel;
use crate::options::Channels;
use forest_pack::{Codec, PackError, PackWriter, SectionId, header, kind};
use std::ops::Range;

/// Writes the views of `block` with these levels, of which there is at least one, and of its channels
/// those of `channels`.
///
/// # Errors
/// When a section is damaged, or the pack cannot be written.
///
/// # Panics
/// When there are no such levels.
pub fn prune(
    block: &ViewsBlock,
    levels: Range<usize>,
    channels: Channels,
    writer: &mut PackWriter,
) -> Result<(), PackError> {
    let mut head = block.header.clone();
    assert!(!levels.is_empty() && levels.end <= head.levels.len(), "levels {levels:?}");
    head.levels = head.levels[levels.clone()].to_vec();
    head.channels.normal &= channels.normal;
    head.channels.depth &= channels.depth;
    head.channels.sky &= channels.sky;
    header::write(writer, SectionId::new(kind::VIEWS_HEADER, 0), &head)?;
    for (slot, level) in (0..).zip(levels) {
        let tiles = bytemuck::cast_slice(block.tiles[level]);
        writer.add(SectionId::new(kind::VIEWS_TILES, slot), Codec::None, tiles)?;
        for channel in Channel::ALL.into_iter().filter(|c| head.channels.has(*c)) {
            let texels = block.stored(channel, level)?;
            writer.add(SectionId::new(section_kind(channel), slot), Codec::None, &texels)?;
        }
    }
    Ok(())
}
