//! The texture dictionary: the pictures of all panels in one atlas.

use crate::error::FoliageError;
use crate::panel::Panel;
use bcdec_rs::bc7 as decode_bc7;
use etagere::{AllocatorOptions, AtlasAllocator, size2};
use forest_soup::linear_to_srgb8;
use intel_tex_2::{RgbaSurface, bc7};
use rayon::prelude::*;

/// Texels of the longest side of an atlas.
pub(crate) const MOST_SIDE: u32 = 8192;

/// Empty texels around every picture.
const GUTTER: u32 = 1;

/// Levels of resolution of an atlas: at the coarsest, pictures that lie four texels apart touch.
pub(crate) const MIPS: u32 = 3;

/// Where pictures lie.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Layout {
    /// Texels across and down; multiples of 16, so that all mips are whole blocks.
    pub(crate) size: [u32; 2],
    /// Top left texel of each picture.
    pub(crate) places: Vec<[u32; 2]>,
}

impl Layout {
    pub(crate) fn new(panels: &[Panel]) -> Result<Self, FoliageError> {
        let padded = |p: &Panel| p.size.map(|s| s + 2 * GUTTER);
        let texels: u64 = panels.iter().map(padded).map(|[w, h]| u64::from(w) * u64::from(h)).sum();
        let widest = panels.iter().map(|p| padded(p)[0]).max().unwrap_or(1);
        let mut side = (texels.isqrt() as u32 + 1).max(widest).next_multiple_of(16);
        while side <= MOST_SIDE {
            if let Some(layout) = Self::try_width(panels, side) {
                return Ok(layout);
            }
            side = (side + side / 16 + 16).next_multiple_of(16);
        }
        let limit = u64::from(MOST_SIDE) * u64::from(MOST_SIDE);
        Err(FoliageError::AtlasFull { texels, limit })
    }

    /// An atlas that is not higher than wide.
    fn try_width(panels: &[Panel], side: u32) -> Option<Self> {
        let options = AllocatorOptions { alignment: size2(4, 4), ..AllocatorOptions::default() };
        let mut atlas = AtlasAllocator::with_options(size2(side as i32, side as i32), &options);
        let mut order: Vec<usize> = (0..panels.len()).collect();
        // Shelves want pictures of like height beside each other.
        order.sort_by_key(|&i| (std::cmp::Reverse((panels[i].size[1], panels[i].size[0])), i));
        let mut out = Self { size: [side, 16], places: vec![[0; 2]; panels.len()] };
        for i in order {
            let [w, h] = panels[i].size.map(|s| (s + 2 * GUTTER) as i32);
            let at = atlas.allocate(size2(w, h))?.rectangle.min;
            out.places[i] = [at.x as u32 + GUTTER, at.y as u32 + GUTTER];
            out.size[1] = out.size[1].max((at.y + h) as u32);
        }
        out.size[1] = out.size[1].next_multiple_of(16);
        Some(out)
    }
}

/// All resolutions of the atlas, finest first: sRGB colour, not premultiplied, and coverage. Texels
/// that nothing covers have the colour of what is near.
pub(crate) fn atlas(panels: &[Panel], layout: &Layout) -> Vec<Vec<[u8; 4]>> {
    let [width, height] = layout.size.map(|s| s as usize);
    let mut texels = vec![[0.0f32; 4]; width * height];
    for (panel, [x, y]) in panels.iter().zip(&layout.places) {
        let columns = panel.size[0] as usize;
        for (r, row) in panel.pixels.chunks_exact(columns).enumerate() {
            let at = (*y as usize + r) * width + *x as usize;
            texels[at..at + columns].copy_from_slice(row);
        }
    }
    let mut levels = vec![(width, texels)];
    // Down to one texel of the coarsest blocks: for colours, not to be stored.
    while levels.len() < MIPS as usize + 2 {
        let (w, finer) = levels.last().expect("a level");
        let next = halved(finer, *w);
        levels.push((w / 2, next));
    }
    let mut out = Vec::new();
    let mut coarser: Vec<[f32; 3]> = Vec::new();
    for (w, texels) in levels.into_iter().rev() {
        let colors: Vec<[f32; 3]> = texels
            .iter()
            .enumerate()
            .map(|(i, [r, g, b, a])| match *a > 0.0 {
                true => [r / a, g / a, b / a],
                false => {
                    coarser.get((i / w / 2) * (w / 2) + i % w / 2).copied().unwrap_or_default()
                }
            })
            .collect();
        let texel = |(c, t): (&[f32; 3], &[f32; 4])| {
            let [r, g, b] = c.map(linear_to_srgb8);
            [r, g, b, (t[3] * 255.0).round() as u8]
        };
        out.push(colors.par_iter().zip(&texels).map(texel).collect());
        coarser = colors;
    }
    out.reverse();
    out.truncate(MIPS as usize);
    out
}

fn halved(finer: &[[f32; 4]], width: usize) -> Vec<[f32; 4]> {
    let half = width / 2;
    let count = half * (finer.len() / width / 2);
    (0..count)
        .into_par_iter()
        .map(|i| {
            let first = (i / half) * 2 * width + (i % half) * 2;
            let four = [first, first + 1, first + width, first + width + 1].map(|j| finer[j]);
            std::array::from_fn(|k| 0.25 * four.iter().map(|t| t[k]).sum::<f32>())
        })
        .collect()
}

/// Rows of blocks that a thread encodes at once.
const STRIP: usize = 16;

/// BC7 blocks of a picture whose sides are multiples of 4.
pub(crate) fn encode(texels: &[[u8; 4]], width: u32) -> Vec<u8> {
    let strip = |rows: &[[u8; 4]]| {
        let height = rows.len() as u32 / width;
        let data = bytemuck::cast_slice(rows);
        let surface = RgbaSurface { data, width, height, stride: 4 * width };
        bc7::compress_blocks(&bc7::alpha_very_fast_settings(), &surface)
    };
    texels.par_chunks(width as usize * 4 * STRIP).flat_map_iter(strip).collect()
}

/// The texels of BC7 blocks: a whole number of block rows.
pub(crate) fn decode(blocks: &[u8], width: u32) -> Vec<[u8; 4]> {
    let (row, block_row) = (width as usize * 4, width as usize * 4);
    let mut out = vec![[0u8; 4]; blocks.len()];
    let rows = out.par_chunks_mut(width as usize * 4);
    rows.zip(blocks.par_chunks(block_row)).for_each(|(rows, blocks)| {
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(rows);
        for (i, block) in blocks.chunks_exact(16).enumerate() {
            decode_bc7(block, &mut bytes[16 * i..], row);
        }
    });
    out
}
