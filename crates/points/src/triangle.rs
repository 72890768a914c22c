//! The triangle record: what is drawn where points would be too large. 40 bytes.

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

/// One corner, 12 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct VertexRecord {
    /// Position in steps from the cell's origin, on the same lattice as the points.
    pub position: [u16; 3],
    /// Texture coordinates in steps of the material's [`UvRange`].
    pub uv: [u16; 2],
    /// Octahedral normal, see [`crate::record::decode_axis`].
    pub normal: [u8; 2],
}

/// One triangle, 40 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct TriangleRecord {
    /// The corners.
    pub corners: [VertexRecord; 3],
    /// Index into the pack's materials.
    pub material: u16,
    /// Size code of its surfels: it is drawn instead of them where they would be larger than the
    /// threshold between points and triangles.
    pub size: u16,
}

const _: () = assert!(size_of::<TriangleRecord>() == 40);

/// How the `u16` texture coordinates of a material map to real ones: `min + step · q`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct UvRange {
    /// Texture coordinates of step 0.
    pub min: [f32; 2],
    /// Size of a step; 0 where all coordinates are equal.
    pub step: [f32; 2],
}

impl UvRange {
    /// The steps nearest to texture coordinates within the range.
    pub(crate) fn quantise(&self, uv: [f32; 2]) -> [u16; 2] {
        std::array::from_fn(|k| {
            if self.step[k] > 0.0 {
                ((uv[k] - self.min[k]) / self.step[k]).round() as u16
            } else {
                0
            }
        })
    }

    /// The texture coordinates of quantised ones.
    pub fn decode(&self, q: [u16; 2]) -> [f32; 2] {
        std::array::from_fn(|k| self.min[k] + self.step[k] * f32::from(q[k]))
    }
}
