//! The header and the nodes of the volume representation.

use crate::frame::CameraFrame;
use crate::lattice::{Branching, Lattice};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, UVec3};
use serde::{Deserialize, Serialize};

/// Section `volume.header`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VolumeHeader {
    /// Corner of the root cell with the smallest coordinates, in the world.
    pub corner: [f64; 3],
    /// Side of the root cell in world units.
    pub side: f64,
    /// The source's box, in the world: smallest and largest corner.
    pub bounds: [[f64; 3]; 2],
    /// How cells are cut.
    pub branching: Branching,
    /// Texels along the side of a billboard: 2, 4 or 8.
    pub texels: u32,
    /// Share of a cell that had to be hidden for it to have no billboard.
    pub prune: f64,
    /// The cameras.
    pub cameras: Vec<CameraFrame>,
    /// Levels, from the root down.
    pub levels: Vec<LevelHeader>,
    /// How billboards are stored.
    pub coding: Coding,
}

/// One level.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct LevelHeader {
    /// Number of nodes: cells that have, or hold cells that have, billboards.
    pub nodes: u32,
    /// Number of billboards, of all cameras.
    pub billboards: u32,
}

/// How billboards are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Coding {
    /// Texel by texel, sRGB and alpha.
    Texels,
    /// By the number of a colour and of an alpha codeword.
    Codebook {
        /// Codewords of colour, ≥ 1.
        colors: u32,
        /// Codewords of alpha, ≥ 1.
        alphas: u32,
        /// The atlas of codewords is compressed (BC3).
        block: bool,
    },
}

/// Texels across an atlas of codewords (paper 004, section 4.1.2: "typically of size 512x512").
pub const ATLAS_WIDTH: u32 = 512;

impl VolumeHeader {
    /// The lattice of the cells.
    pub fn lattice(&self) -> Lattice {
        Lattice {
            corner: DVec3::from_array(self.corner),
            side: self.side,
            branching: self.branching,
            levels: self.levels.len().saturating_sub(1) as u32,
        }
    }

    /// Texels of a billboard.
    pub fn billboard_texels(&self) -> usize {
        (self.texels * self.texels) as usize
    }

    /// 32-bit words of a node's camera mask.
    pub fn mask_words(&self) -> usize {
        self.cameras.len().div_ceil(32)
    }
}

impl Coding {
    /// Bits of the numbers of a billboard's codewords; all bits of a billboard of raw `texels`.
    pub fn billboard_bits(&self, texels: usize) -> u32 {
        match *self {
            Self::Texels => 32 * texels as u32,
            Self::Codebook { colors, alphas, .. } => {
                forest_vq::bits_for(colors as usize) + forest_vq::bits_for(alphas as usize)
            }
        }
    }

    /// Texels down the atlas of codewords of `texels` a side: a multiple of 4; 0 without one.
    pub fn atlas_height(&self, texels: u32) -> u32 {
        match *self {
            Self::Texels => 0,
            Self::Codebook { colors, alphas, .. } => {
                let rows = colors.max(alphas).div_ceil(ATLAS_WIDTH / texels);
                (rows * texels).next_multiple_of(4)
            }
        }
    }

    /// Stored bytes of the atlas.
    pub fn atlas_bytes(&self, texels: u32) -> u64 {
        let area = u64::from(ATLAS_WIDTH) * u64::from(self.atlas_height(texels));
        match self {
            Self::Codebook { block: true, .. } => area,
            _ => area * 4,
        }
    }
}

/// A node of a level: a record of 20 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Pod, Zeroable)]
#[repr(C)]
pub struct NodeRecord {
    /// Place in the level's grid: x, y, z.
    pub place: [u16; 3],
    /// Opacity · 255 of the cell, in the mean over directions.
    pub opacity: u8,
    /// 0.
    pub zero: u8,
    /// Bit k is set if child k is there: (z·f + y)·f + x of its place in the parent.
    pub children: u32,
    /// Index in the next level of the first child; the others follow it.
    pub first_child: u32,
    /// Index of the first billboard in the level; those of the cameras in the node's mask follow
    /// in the order of the cameras.
    pub first_billboard: u32,
}

const _: () = assert!(size_of::<NodeRecord>() == 20);

impl NodeRecord {
    /// Place in the level's grid.
    pub fn place(&self) -> UVec3 {
        UVec3::from_array(self.place.map(u32::from))
    }
}
