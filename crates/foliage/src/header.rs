//! The header and records of the foliage representation.

use crate::wind::Hung;
use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

/// The number of the dictionary among a draw's materials.
pub const DICTIONARY: u16 = u16::MAX;

/// Section `foliage.header`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoliageHeader {
    /// World position of the zero of vertices and branches.
    pub origin: [f64; 3],
    /// The source's box about the origin, in world units: smallest and largest corner.
    pub bounds: [[f64; 3]; 2],
    /// Steps of a vertex' pivot, in world units.
    pub pivot_step: f64,
    /// Texels across and down the dictionary's finest resolution.
    pub atlas: [u32; 2],
    /// The dictionary is stored in BC7 blocks; else as RGBA.
    pub blocks: bool,
    /// Triangles of the source: wood and leaves.
    pub source: [u64; 2],
    /// Branches of the skeleton, by order: trunk, its branches, theirs, all others.
    pub branches: [u32; 4],
    /// Records of branches that wind moves.
    pub wind: u32,
    /// Share of a light's translucency that leaves have in the mean, 0 … 1.
    pub translucency: f32,
    /// Levels, finest first.
    pub levels: Vec<LevelHeader>,
}

/// One level: a mesh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LevelHeader {
    /// World units of a texel of its pictures: the level is for pixels of this size.
    pub texel: f64,
    /// Number of vertices.
    pub vertices: u32,
    /// The first of them, which are wood; the others are those of cards and sheets.
    pub wood_vertices: u32,
    /// Share of the sun that cards and sheets get of what reaches them: leaves of one card shade each other.
    pub sunlit: f32,
    /// Its triangles, material by material: they follow each other in the index section.
    pub draws: Vec<Draw>,
    /// Tubes of thick branches.
    pub tubes: u32,
    /// Bent sheets of groups of thin ones.
    pub sheets: u32,
    /// Cards of leaf clusters.
    pub cards: u32,
    /// Thick branches and groups of thin ones that were left out: nobody sees them.
    pub hidden: u32,
    /// How thick branches were made.
    pub wood: WoodWay,
}

/// How the thick branches of a level were made: the better of two, at equal triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum WoodWay {
    /// Tubes along the skeleton.
    Tubes,
    /// The source's triangles, simplified by meshoptimizer.
    Simplified,
}

/// Triangles of one material.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Draw {
    /// Number in the pack's materials, or [`DICTIONARY`].
    pub material: u16,
    /// Number of triangles.
    pub triangles: u32,
}

impl LevelHeader {
    /// Triangles of all draws.
    pub fn triangles(&self) -> u64 {
        self.draws.iter().map(|d| u64::from(d.triangles)).sum()
    }
}

/// A corner: 40 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct VertexRecord {
    /// Place at rest, about the header's origin.
    pub position: [f32; 3],
    /// Texture coordinates, v down.
    pub uv: [f32; 2],
    /// What moves it.
    pub hung: Hung,
    /// From `position` to the pivot about which its card turns, in the header's steps.
    pub pivot: [i16; 3],
    /// Phase of that turning, 65536 to a turn.
    pub phase: u16,
    /// Unit normal, as [`forest_points::record::encode_axis`] has it.
    pub normal: [u8; 2],
    /// Share of the sky that is seen from there, 0 … 255.
    pub openness: u8,
    /// 255 if it turns like a leaf, 0 if it does not.
    pub flutter: u8,
    /// sRGB colour that multiplies the material, and alpha.
    pub color: [u8; 4],
}

const _: () = assert!(size_of::<VertexRecord>() == 40);
