//! Tiles as whole squares again.

use forest_pack::PackError;
use forest_views::{Texels, TileRecord, ViewsBlock};

/// A texel of a whole tile, as the pack stores it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Texel {
    /// sRGB, not premultiplied, and coverage.
    pub(crate) color: [u8; 4],
    /// Right and up in the view's frame.
    pub(crate) normal: [u8; 2],
    /// 0 near, 65535 far.
    pub(crate) depth: u16,
    pub(crate) sky: u8,
}

/// The tiles of a level, without trimming.
pub(crate) struct WholeTiles<'a> {
    tiles: &'a [TileRecord],
    texels: Texels,
    /// Texels along the side of a tile.
    pub(crate) side: u32,
}

impl<'a> WholeTiles<'a> {
    pub(crate) fn read(block: &'a ViewsBlock, level: usize) -> Result<Self, PackError> {
        Ok(Self {
            tiles: block.tiles[level],
            texels: block.texels(level)?,
            side: block.header.levels[level].texels,
        })
    }

    /// The threshold of a view's alpha.
    pub(crate) fn cutoff(&self, view: u32) -> u16 {
        self.tiles[view as usize].cutoff
    }

    /// Texel (x, y) of a view: outside of what is stored, the nearest stored one without coverage.
    pub(crate) fn texel(&self, view: u32, x: u32, y: u32) -> Texel {
        let tile = &self.tiles[view as usize];
        if tile.width == 0 {
            return Texel { color: [0; 4], normal: [128; 2], depth: u16::MAX / 2, sky: 255 };
        }
        let (x, y) = (x as i32, y as i32);
        let clamp = |v: i32, from: i16, size: u16| {
            v.clamp(i32::from(from), i32::from(from) + i32::from(size) - 1)
        };
        let near = (clamp(x, tile.left, tile.width), clamp(y, tile.top, tile.height));
        let i = self.texels.index(tile, near.0, near.1).expect("clamped into the tile");
        let t = &self.texels;
        let mut color = t.color[i];
        if near != (x, y) {
            color[3] = 0;
        }
        Texel {
            color,
            normal: t.normal.get(i).copied().unwrap_or([128; 2]),
            depth: t.depth.get(i).copied().unwrap_or(u16::MAX / 2),
            sky: t.sky.get(i).copied().unwrap_or(255),
        }
    }

    /// All texels of a view, row by row from the top.
    pub(crate) fn texels(&self, view: u32) -> impl Iterator<Item = (u32, u32, Texel)> + '_ {
        (0..self.side * self.side).map(move |i| {
            let (x, y) = (i % self.side, i / self.side);
            (x, y, self.texel(view, x, y))
        })
    }
}
