//! A sheet of all views, for people.

use crate::ExportError;
use crate::grid::WholeTiles;
use crate::picture::{check_size, png};
use forest_soup::{linear_to_srgb8, srgb8_to_linear};
use forest_views::{Layout, ViewsBlock};
use image::{Rgb, RgbImage};

/// Linear grey behind the tree.
const BACKGROUND: f32 = 0.6;

/// Longest side of a sheet, if tiles are not larger.
const SIDE: u32 = 2048;

/// A PNG of all views over grey: octahedral ones in their grid, rings from the pole down.
///
/// # Errors
/// When the pack is damaged.
pub fn contact_sheet(block: &ViewsBlock) -> Result<Vec<u8>, ExportError> {
    let directions = block.directions();
    let count = directions.count();
    let columns = match directions.layout {
        Layout::Octahedral { side } => side,
        Layout::Rings { points, .. } => points,
    };
    let rows = count.div_ceil(columns);
    let levels = &block.header.levels;
    let fits = |texels: u32| texels * columns.max(rows) <= SIDE;
    let level = levels.iter().position(|l| fits(l.texels)).unwrap_or(levels.len() - 1);
    check_size(columns * levels[level].texels, rows * levels[level].texels)?;
    let tiles = WholeTiles::read(block, level)?;
    let side = tiles.side;
    let grey = linear_to_srgb8(BACKGROUND);
    let mut sheet = RgbImage::from_pixel(columns * side, rows * side, Rgb([grey; 3]));
    for view in 0..count {
        // Octahedral rows lie as they are numbered; rings are stacked with the highest on top.
        let row = match directions.layout {
            Layout::Octahedral { .. } => view / columns,
            Layout::Rings { .. } => rows - 1 - view / columns,
        };
        for (x, y, texel) in tiles.texels(view) {
            let [r, g, b, a] = texel.color;
            let over = |c: u8| {
                let a = f32::from(a) / 255.0;
                linear_to_srgb8(srgb8_to_linear(c) * a + BACKGROUND * (1.0 - a))
            };
            sheet.put_pixel(view % columns * side + x, row * side + y, Rgb([r, g, b].map(over)));
        }
    }
    png(sheet)
}
