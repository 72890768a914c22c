//! Pivots and parents of branches as textures, for materials that read Pivot Painter 2 data.
//!
//! A texel is a branch of the wind's table; `TEXCOORD_1` of the exported glb points at the middle of the
//! branch's own. The first texture has the place where the branch grows in red, green and blue, in half floats,
//! and in alpha the number of its parent as the bits of a half float, 1024 added (the trunk is its own parent);
//! the second the direction to its tip, ½ for zero, and its length over 2048. Lengths are centimetres, axes x, z,
//! y of the mesh: z up, left-handed (Epic Games, "Pivot Painter Tool 2.0" and its material functions
//! DecodePosition, UnpackIntegerAsFloat, DecodeAxisVector and Decode8BitAlphaAxisExtent).

use crate::ExportError;
use crate::picture::{ExportFile, png};
use exr::prelude::{Image, SpecificChannels, WritableImage};
use forest_foliage::{BranchRecord, FoliageBlock, NO_BRANCH};
use glam::{DVec3, Vec3};
use half::f16;
use image::{Rgba, RgbaImage};
use std::io::Cursor;

/// Centimetres of a world unit.
const CENTIMETRES: f64 = 100.0;

/// Length that alpha 1 of the second texture stands for, in centimetres.
const MOST_EXTENT: f64 = 2048.0;

/// What is added to a parent's number, so that its bits are those of a normal half float.
const FIRST_NORMAL: u16 = 1024;

/// Most branches: numbers are the bits of positive, finite half floats.
const MOST_BRANCHES: usize = 30_000;

/// Where branches lie in the textures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PivotTable {
    size: [u32; 2],
}

impl PivotTable {
    /// As square as powers of two let it be.
    pub(crate) fn new(branches: &[BranchRecord]) -> Self {
        let count = branches.len().max(1) as u32;
        let width = f64::from(count).sqrt().ceil() as u32;
        let width = width.next_power_of_two();
        Self { size: [width, count.div_ceil(width).next_power_of_two()] }
    }

    /// Texture coordinates of the middle of a branch's texel, v down.
    pub(crate) fn texel(&self, branch: u32) -> [f32; 2] {
        let [width, height] = self.size;
        let at = [branch % width, branch / width];
        [(at[0] as f32 + 0.5) / width as f32, (at[1] as f32 + 0.5) / height as f32]
    }
}

/// A vector of the mesh in the axes of the textures.
fn turned(v: DVec3) -> DVec3 {
    DVec3::new(v.x, v.z, v.y)
}

/// The two textures of a pack's branches: an EXR file and a PNG file.
///
/// # Errors
/// When there are more branches than the textures can tell apart, one is too far away for half floats, or a file cannot be encoded.
pub fn pivots(foliage: &FoliageBlock, name: &str) -> Result<[ExportFile; 2], ExportError> {
    let branches = foliage.branches;
    if branches.len() > MOST_BRANCHES {
        let problem =
            format!("{} branches; pivot textures take {MOST_BRANCHES} at most", branches.len());
        return Err(ExportError::Unsuited(problem));
    }
    let table = PivotTable::new(branches);
    let size = table.size.map(|s| s as usize);
    // As the vertices of the glb.
    let origin = foliage.origin() - crate::glb::place(foliage);
    let farthest = branches
        .iter()
        .map(|b| (origin + DVec3::from(b.base.map(f64::from))).abs().max_element() * CENTIMETRES)
        .fold(0.0, f64::max);
    if farthest > f64::from(f16::MAX) {
        let problem = format!(
            "a branch {farthest:.0} cm from the tree's zero; half floats hold {} cm: export the tree at its own \
             place",
            f16::MAX
        );
        return Err(ExportError::Unsuited(problem));
    }
    let pivot = |i: usize| -> (f16, f16, f16, f16) {
        let Some(branch) = branches.get(i) else { return Default::default() };
        let base = origin + DVec3::from(branch.base.map(f64::from));
        let [x, y, z] = (turned(base) * CENTIMETRES).to_array().map(f16::from_f64);
        let parent = if branch.parent == NO_BRANCH { i } else { branch.parent as usize };
        (x, y, z, f16::from_bits(parent as u16 + FIRST_NORMAL))
    };
    let channels =
        SpecificChannels::rgba(|at: exr::math::Vec2<usize>| pivot(at.1 * size[0] + at.0));
    let mut exr = Cursor::new(Vec::new());
    Image::from_channels((size[0], size[1]), channels).write().to_buffered(&mut exr)?;
    let mut axes = RgbaImage::new(table.size[0], table.size[1]);
    for (i, branch) in (0u32..).zip(branches) {
        let tip = (Vec3::from(branch.linear) + Vec3::from(branch.square)).as_dvec3();
        let [x, y, z] = turned(tip.normalize_or(DVec3::Y)).to_array().map(|v| code(v * 0.5 + 0.5));
        let length = code(tip.length() * CENTIMETRES / MOST_EXTENT);
        axes.put_pixel(i % table.size[0], i / table.size[0], Rgba([x, y, z, length]));
    }
    let file = |what: &str, bytes| ExportFile { name: format!("T_{name}_{what}"), bytes };
    Ok([
        file("PivotPosition_ParentIndex.exr", exr.into_inner()),
        file("XVector_XExtent.png", png(axes)?),
    ])
}

fn code(v: f64) -> u8 {
    (v.clamp(0.0, 1.0) * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_are_told_row_by_row() {
        let table = PivotTable::new(&[BranchRecord::default(); 5]);
        assert_eq!(table.size, [4, 2]);
        assert_eq!(table.texel(0), [0.125, 0.25]);
        assert_eq!(table.texel(4), [0.125, 0.75]);
    }
}
