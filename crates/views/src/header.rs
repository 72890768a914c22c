//! The header and the tile table of the views representation.

use crate::directions::Directions;
use crate::options::{Channels, Fit, Quality};
use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// No tile has more texels along a side.
pub(crate) const MAX_TEXELS: u32 = 4096;

/// Section `views.header`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ViewsHeader {
    /// World position of the middle of all tiles: the middle of the source's box.
    pub center: [f64; 3],
    /// Half the side of a tile, in world units.
    pub half: f64,
    /// Radius of the smallest ball about `center` that holds the source, in world units: depth 0 is
    /// this far before the centre, 1 as far behind it.
    pub radius: f64,
    /// The source's box about `center`, in world units: smallest and largest corner.
    pub bounds: [[f64; 3]; 2],
    /// Where views were taken from.
    pub directions: Directions,
    /// What is stored.
    pub channels: Channels,
    /// How it is stored.
    pub quality: Quality,
    /// How tiles are framed.
    pub fit: Fit,
    /// Samples of a texel of the finest level.
    pub samples: u32,
    /// Levels, finest first; each has half as many texels along a tile's side as the one before.
    pub levels: Vec<LevelHeader>,
}

/// One level: every view at one resolution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LevelHeader {
    /// Texels along the side of a whole tile.
    pub texels: u32,
    /// Texels across and down a page: multiples of 4.
    pub page: [u32; 2],
    /// Number of pages.
    pub pages: u32,
}

impl LevelHeader {
    /// Texels of all pages.
    pub fn page_texels(&self) -> u64 {
        u64::from(self.page[0]) * u64::from(self.page[1]) * u64::from(self.pages)
    }
}

/// Where a view's tile lies in a level: a record of 16 bytes. Only the part of the tile that shows
/// something is stored, with a gutter of a texel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct TileRecord {
    /// Place of the stored part in its page, multiples of 4.
    pub x: u16,
    /// Rows from the top of the page.
    pub y: u16,
    /// The page.
    pub page: u16,
    /// Alpha · 255 from which a texel passes the alpha test, so that as many pass as the view
    /// covers; 1 … 255.
    pub cutoff: u16,
    /// Place of the stored part in the tile; −1 where the gutter lies outside.
    pub left: i16,
    /// Rows from the top of the tile.
    pub top: i16,
    /// Texels across, a multiple of 4; 0 for a view that shows nothing.
    pub width: u16,
    /// Texels down, a multiple of 4; 0 for a view that shows nothing.
    pub height: u16,
}

const _: () = assert!(size_of::<TileRecord>() == 16);

/// The frame of a view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewFrame {
    /// Unit vector to the right of the tile.
    pub right: DVec3,
    /// Unit vector to the top of the tile.
    pub up: DVec3,
    /// Unit vector towards the camera.
    pub back: DVec3,
}

impl ViewFrame {
    /// The frame of the view from direction `back`: the tile's top is as near to +Y as it can be
    /// (−Z from the zenith, +Z from the nadir), as that of [`forest_soup::Camera`].
    pub fn new(back: DVec3) -> Self {
        let projection = forest_soup::Projection::Orthographic { height: 1.0 };
        let camera = forest_soup::Camera::new(DVec3::ZERO, -back, projection, [1; 2]);
        Self { right: camera.right, up: camera.up, back: -camera.forward }
    }
}

impl ViewsHeader {
    /// The frames of all views.
    pub fn frames(&self) -> Vec<ViewFrame> {
        let frame = |i| ViewFrame::new(self.directions.direction(i));
        (0..self.directions.count()).map(frame).collect()
    }
}
