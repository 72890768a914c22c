//! Texels to stored bytes and back. BC blocks are written by Intel's encoder and read by `bcdec`.

use crate::header::LevelHeader;
use crate::options::Quality;
use intel_tex_2::{RSurface, RgSurface, RgbaSurface, bc4, bc5, bc7};
use rayon::prelude::*;

/// One channel of an atlas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// sRGB colour and coverage.
    Color,
    /// Normals in the view's frame: right and up, −1 … 1 as 0 … 255.
    Normal,
    /// Depth, 0 near and 1 far: 16 bits, 8 when compressed.
    Depth,
    /// Share of the sky that is seen.
    Sky,
}

impl Channel {
    /// All channels, in the order of their section kinds.
    pub const ALL: [Self; 4] = [Self::Color, Self::Normal, Self::Depth, Self::Sky];

    /// Bytes of a texel in memory: those that [`encode`] takes.
    pub fn raw_bytes(self) -> usize {
        match self {
            Self::Color => 4,
            Self::Normal | Self::Depth => 2,
            Self::Sky => 1,
        }
    }

    /// Stored bytes of 16 texels.
    pub fn block_bytes(self, quality: Quality) -> u64 {
        match (quality, self) {
            (Quality::Lossless, channel) => 16 * channel.raw_bytes() as u64,
            (Quality::Block, Self::Color | Self::Normal) => 16,
            (Quality::Block, Self::Depth | Self::Sky) => 8,
        }
    }

    /// Stored bytes of a level.
    pub(crate) fn level_bytes(self, quality: Quality, level: &LevelHeader) -> u64 {
        level.page_texels() / 16 * self.block_bytes(quality)
    }
}

/// Rows of blocks that a thread encodes at once.
const STRIP: usize = 16;

/// Encodes pictures of `width` texels a row, one under the other; both in multiples of 4 unless lossless.
pub fn encode(channel: Channel, quality: Quality, width: u32, raw: &[u8]) -> Vec<u8> {
    if quality == Quality::Lossless || raw.is_empty() {
        return raw.to_vec();
    }
    let row = width as usize * channel.raw_bytes();
    raw.par_chunks(row * 4 * STRIP)
        .flat_map_iter(|strip| {
            let height = (strip.len() / row) as u32;
            match channel {
                Channel::Color => {
                    let stride = row as u32;
                    let surface = RgbaSurface { data: strip, width, height, stride };
                    bc7::compress_blocks(&bc7::alpha_very_fast_settings(), &surface)
                }
                Channel::Normal => {
                    let stride = row as u32;
                    bc5::compress_blocks(&RgSurface { data: strip, width, height, stride })
                }
                Channel::Depth => {
                    // 8 of the 16 bits.
                    let data: Vec<u8> = strip
                        .as_chunks::<2>()
                        .0
                        .iter()
                        .map(|d| ((u32::from(u16::from_le_bytes(*d)) + 128) / 257) as u8)
                        .collect();
                    bc4::compress_blocks(&RSurface { data: &data, width, height, stride: width })
                }
                Channel::Sky => {
                    bc4::compress_blocks(&RSurface { data: strip, width, height, stride: width })
                }
            }
        })
        .collect()
}

/// Decodes what [`encode`] made; `stored` must have the length of a whole number of block rows.
pub fn decode(channel: Channel, quality: Quality, width: u32, stored: &[u8]) -> Vec<u8> {
    if quality == Quality::Lossless || stored.is_empty() {
        return stored.to_vec();
    }
    let row = width as usize * channel.raw_bytes();
    let block_row = (width as usize / 4) * channel.block_bytes(quality) as usize;
    let mut out = vec![0; stored.len() / block_row * row * 4];
    out.par_chunks_mut(row * 4).zip(stored.par_chunks(block_row)).for_each(|(rows, blocks)| {
        let blocks = blocks.chunks_exact(channel.block_bytes(quality) as usize);
        for (i, block) in blocks.enumerate() {
            match channel {
                Channel::Color => bcdec_rs::bc7(block, &mut rows[i * 16..], row),
                Channel::Normal => bcdec_rs::bc5(block, &mut rows[i * 8..], row, false),
                Channel::Sky => bcdec_rs::bc4(block, &mut rows[i * 4..], row, false),
                Channel::Depth => {
                    // Between the two ends of a block depth is finer than 8 bits.
                    let mut fine = [0.0; 16];
                    bcdec_rs::bc4_float(block, &mut fine, 4, false);
                    for (k, d) in fine.into_iter().enumerate() {
                        let at = (k / 4) * row + (i * 4 + k % 4) * 2;
                        let d = (d * 65535.0).round() as u16;
                        rows[at..at + 2].copy_from_slice(&d.to_le_bytes());
                    }
                }
            }
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_come_back_nearly_and_lossless_exactly() {
        let (width, height) = (64u32, 40u32);
        for channel in Channel::ALL {
            let bytes = channel.raw_bytes();
            let texel = |i: usize| {
                let (x, y) = (i as u32 % width, i as u32 / width);
                let v = [x * 3 + y, 255 - x * 2, y * 5, 128 + y];
                match channel {
                    Channel::Depth => ((x * 700 + y * 400) as u16).to_le_bytes().to_vec(),
                    _ => v[..bytes].iter().map(|v| (*v).min(255) as u8).collect(),
                }
            };
            let raw: Vec<u8> = (0..(width * height) as usize).flat_map(texel).collect();
            let exact = encode(channel, Quality::Lossless, width, &raw);
            assert_eq!(decode(channel, Quality::Lossless, width, &exact), raw);
            let stored = encode(channel, Quality::Block, width, &raw);
            let want = u64::from(width * height / 16) * channel.block_bytes(Quality::Block);
            assert_eq!(stored.len() as u64, want);
            let back = decode(channel, Quality::Block, width, &stored);
            assert_eq!(back.len(), raw.len());
            let value = |b: &[u8], i: usize| match channel {
                Channel::Depth => f64::from(u16::from_le_bytes([b[2 * i], b[2 * i + 1]])) / 257.0,
                _ => f64::from(b[i]),
            };
            let count = if channel == Channel::Depth { raw.len() / 2 } else { raw.len() };
            let square: f64 = (0..count).map(|i| (value(&raw, i) - value(&back, i)).powi(2)).sum();
            let rms = (square / count as f64).sqrt();
            assert!(rms < 3.0, "{channel:?}: {rms}");
        }
    }
}
