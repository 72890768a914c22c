//! Reading the views of a pack.

use crate::bake::section_kind;
use crate::codec::{Channel, decode};
use crate::directions::Directions;
use crate::header::{TileRecord, ViewFrame, ViewsHeader};
use crate::validate::validate;
use forest_pack::{Codec, Pack, PackError, SectionId, header, kind};
use glam::DVec3;
use std::borrow::Cow;

/// The views representation of a pack; texels stay in the memory map until they are decoded.
#[derive(Clone, Debug)]
pub struct ViewsBlock<'a> {
    /// The header.
    pub header: ViewsHeader,
    /// The tiles of each level, one a view.
    pub tiles: Vec<&'a [TileRecord]>,
    /// The frames of all views.
    pub frames: Vec<ViewFrame>,
    pack: &'a Pack,
}

impl<'a> ViewsBlock<'a> {
    /// Whether a pack has views.
    pub fn is_in(pack: &Pack) -> bool {
        pack.contains(SectionId::new(kind::VIEWS_HEADER, 0))
    }

    /// Opens and checks the views of a pack.
    ///
    /// # Errors
    /// When a section is missing or damaged, or breaks a rule of SPEC.md, section 6.
    pub fn open(pack: &'a Pack) -> Result<Self, PackError> {
        let id = SectionId::new(kind::VIEWS_HEADER, 0);
        let header: ViewsHeader = header::decode(pack, id)?;
        let lengths = |channel: Channel| -> Vec<Option<u64>> {
            let of = |level| {
                let id = SectionId::new(section_kind(channel), level);
                pack.sections().find(|(s, _)| *s == id).map(|(_, s)| s.length)
            };
            (0..header.levels.len() as u32).map(of).collect()
        };
        let mut tiles = Vec::new();
        crate::validate::validate_header(&header)
            .map_err(|problem| PackError::invalid(pack.path(), id, problem))?;
        // Texels lie as a GPU reads them: nothing grows when it is read.
        let texels = kind::VIEWS_COLOR..=kind::VIEWS_SKY;
        for (id, section) in pack.sections().filter(|(id, _)| texels.contains(&id.kind)) {
            if section.codec != Codec::None {
                return Err(PackError::invalid(
                    pack.path(),
                    id,
                    "is compressed; texels must not be",
                ));
            }
        }
        for level in 0..header.levels.len() as u32 {
            tiles.push(pack.records::<TileRecord>(SectionId::new(kind::VIEWS_TILES, level))?);
        }
        validate(&header, &tiles, &lengths).map_err(|(kind, level, problem)| {
            PackError::invalid(pack.path(), SectionId::new(kind, level), problem)
        })?;
        let frames = header.frames();
        Ok(Self { header, tiles, frames, pack })
    }

    /// The directions of the views.
    pub fn directions(&self) -> &Directions {
        &self.header.directions
    }

    /// World position of the middle of all tiles.
    pub fn center(&self) -> DVec3 {
        DVec3::from_array(self.header.center)
    }

    /// Half the diagonal of the source's box, in world units.
    pub fn half_diagonal(&self) -> f64 {
        let [min, max] = self.header.bounds.map(DVec3::from_array);
        0.5 * min.distance(max)
    }

    /// Stored bytes of a channel of a level; 0 if it is not stored.
    pub fn channel_bytes(&self, channel: Channel, level: usize) -> u64 {
        if !self.header.channels.has(channel) {
            return 0;
        }
        channel.level_bytes(self.header.quality, &self.header.levels[level])
    }

    /// A channel of `level` as it is stored: pages one under the other, in the blocks that graphics
    /// devices read (BC7 colour, BC5 normals, BC4 depth and sky) or plain; empty if it is not stored.
    ///
    /// # Errors
    /// When the section is damaged.
    pub fn stored(&self, channel: Channel, level: usize) -> Result<Cow<'a, [u8]>, PackError> {
        if !self.header.channels.has(channel) {
            return Ok(Cow::Borrowed(&[]));
        }
        let id = SectionId::new(section_kind(channel), level as u32);
        self.pack.bytes(id, self.channel_bytes(channel, level))
    }

    /// Reads and decodes what a renderer needs of `level`.
    ///
    /// # Errors
    /// When a section is damaged.
    pub fn texels(&self, level: usize) -> Result<Texels, PackError> {
        let read = |channel: Channel| -> Result<Vec<u8>, PackError> {
            let stored = self.stored(channel, level)?;
            let width = self.header.levels[level].page[0];
            Ok(decode(channel, self.header.quality, width, &stored))
        };
        let [color, normal, depth, sky] = Channel::ALL.map(read);
        let wide = |d: &[u8; 2]| u16::from_le_bytes(*d);
        Ok(Texels {
            width: self.header.levels[level].page[0] as usize,
            height: self.header.levels[level].page[1] as usize,
            color: color?.as_chunks::<4>().0.to_vec(),
            normal: normal?.as_chunks::<2>().0.to_vec(),
            depth: depth?.as_chunks::<2>().0.iter().map(wide).collect(),
            sky: sky?,
        })
    }
}

/// The decoded pages of a level, one under the other; channels that are not stored are empty.
#[derive(Clone, Debug, Default)]
pub struct Texels {
    /// Texels across a page.
    pub width: usize,
    /// Texels down a page.
    pub height: usize,
    /// sRGB colour, not premultiplied, and coverage.
    pub color: Vec<[u8; 4]>,
    /// Normals in the view's frame: right and up; see [`decode_normal`].
    pub normal: Vec<[u8; 2]>,
    /// Depth: 0 at the front, 65535 at the back of the ball of radius [`ViewsHeader::radius`].
    pub depth: Vec<u16>,
    /// Share of the sky that is seen · 255.
    pub sky: Vec<u8>,
}

impl Texels {
    /// Index of texel (x, y) of the whole tile; `None` where nothing is stored.
    #[inline]
    pub fn index(&self, tile: &TileRecord, x: i32, y: i32) -> Option<usize> {
        let (x, y) = (x - i32::from(tile.left), y - i32::from(tile.top));
        if x < 0 || y < 0 || x >= i32::from(tile.width) || y >= i32::from(tile.height) {
            return None;
        }
        let row = usize::from(tile.page) * self.height + usize::from(tile.y) + y as usize;
        Some(row * self.width + usize::from(tile.x) + x as usize)
    }
}

/// Right, up and towards the camera of a stored normal, whose last part is not negative.
pub fn normal_parts(stored: [u8; 2]) -> [f64; 3] {
    let [x, y] = stored.map(|v| f64::from(v) / 127.5 - 1.0);
    [x, y, (1.0 - x * x - y * y).max(0.0).sqrt()]
}

/// World-space unit normal of a stored one.
pub fn decode_normal(stored: [u8; 2], frame: &ViewFrame) -> DVec3 {
    let [x, y, z] = normal_parts(stored);
    (frame.right * x + frame.up * y + frame.back * z).normalize_or(frame.back)
}

/// Height towards the camera above the plane through the centre of a stored depth, in radii of
/// [`ViewsHeader::radius`]: 1 … −1.
pub fn decode_height(stored: u16) -> f64 {
    1.0 - 2.0 * (f64::from(stored) + OFF_STEPS) / 65535.0
}

/// Share of a step that stored depths lie behind their number: compressed ones are multiples of 1/255,
/// and would often lie exactly on the steps of a ray, where each renderer's rounding decides.
pub const OFF_STEPS: f64 = 0.3;
