//! The vectors: 4 × 4 texels of trees' textures in CIELab.

use anyhow::{Context, Result};
use forest_import::{Block, Limits};
use forest_soup::srgb8_to_linear;
use forest_vq::{Vectors, linear_to_lab};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;
use std::collections::HashSet;
use std::path::PathBuf;

/// Numbers of a vector: 16 texels of three.
pub(crate) const DIMENSION: usize = 48;

/// At most `most` distinct blocks of opaque texels (alphas of 128 and more), shuffled. Blocks
/// start at multiples of 4 texels; if these are too few, one offset after the other is added.
pub(crate) fn lab_blocks(trees: &[PathBuf], most: usize) -> Result<Vectors> {
    let mut textures = Vec::new();
    for tree in trees {
        let name = tree.to_string_lossy().into_owned();
        let model = Block::parse(&[name])?.load(&Limits::default())?.model;
        textures.extend(model.textures);
    }
    let mut seen: HashSet<[[u8; 3]; 16]> = HashSet::new();
    let mut blocks = Vec::new();
    for offset in 0..16 {
        for t in &textures {
            let (width, height) = (t.width as usize, t.height as usize);
            for y in (offset / 4..height.saturating_sub(3)).step_by(4) {
                for x in (offset % 4..width.saturating_sub(3)).step_by(4) {
                    let texel = |i: usize| t.texels[(y + i / 4) * width + x + i % 4];
                    let block = std::array::from_fn(|i| [0, 1, 2].map(|c| texel(i)[c]));
                    if (0..16).all(|i| texel(i)[3] >= 128) && seen.insert(block) {
                        blocks.push(block);
                    }
                }
            }
        }
        if blocks.len() >= most {
            break;
        }
    }
    let mut random = Pcg32::seed_from_u64(0);
    for i in (1..blocks.len()).rev() {
        blocks.swap(i, random.random_range(0..=i as u32) as usize);
    }
    blocks.truncate(most);
    let texels = blocks.iter().flatten();
    let values = texels.flat_map(|t| linear_to_lab(t.map(srgb8_to_linear))).collect();
    Vectors::new(DIMENSION, values).context("blocks")
}
