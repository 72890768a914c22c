//! Where a pixel is sampled.

use crate::opacity::mix;

/// Pixels along a side of the tile whose sample places repeat over the picture.
const TILE: u32 = 4;

/// How many samples a pixel gets, and which draw of their places. (Partial opacity follows a hash of
/// its own, which is the same for all seeds.)
///
/// A pixel is cut into `side × side` strata with one sample in each: at its middle for one sample
/// a pixel (what a GPU draws), else at a place drawn from `seed`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Sampling {
    /// Strata along a side of a pixel, 1 to 16.
    pub side: u32,
    /// Names the draw.
    pub seed: u32,
}

impl Sampling {
    /// One sample, in the middle of the pixel.
    pub const MIDDLE: Self = Self { side: 1, seed: 0 };
    /// 64 samples a pixel.
    pub const TRUTH: Self = Self { side: 8, seed: 1 };

    /// Samples of a pixel.
    pub fn count(&self) -> usize {
        let side = self.side.clamp(1, 16) as usize;
        side * side
    }
}

/// The sample places of a tile of pixels.
pub(crate) struct Pattern {
    side: u32,
    count: usize,
    x: Vec<f32>,
    y: Vec<f32>,
}

impl Pattern {
    pub(crate) fn new(sampling: Sampling) -> Self {
        let side = sampling.side.clamp(1, 16);
        let count = sampling.count();
        let places = |axis: u32| {
            (0..TILE * TILE * count as u32)
                .map(|i| {
                    let stratum = i % count as u32;
                    let cell = if axis == 0 { stratum % side } else { stratum / side };
                    let hash = mix(mix(sampling.seed) ^ mix(2 * i + axis));
                    let jitter = if side == 1 { 0.5 } else { (hash >> 8) as f32 / 16_777_216.0 };
                    (cell as f32 + jitter) / side as f32
                })
                .collect()
        };
        Self { side, count, x: places(0), y: places(1) }
    }

    /// Samples of a pixel.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// Places of the samples of pixel (x, y), in `0..=1` from its top left corner.
    #[inline]
    pub(crate) fn pixel(&self, x: u32, y: u32) -> (&[f32], &[f32]) {
        let first = ((y % TILE) * TILE + x % TILE) as usize * self.count;
        (&self.x[first..][..self.count], &self.y[first..][..self.count])
    }

    /// Coordinates of sample `s` of pixel (x, y) in the picture's sample grid, as the hash rule of
    /// opacity counts them.
    #[inline]
    pub(crate) fn grid(&self, x: u32, y: u32, s: usize) -> (u32, u32) {
        let s = s as u32;
        (x * self.side + s % self.side, y * self.side + s / self.side)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_stratum_has_one_sample() {
        let p = Pattern::new(Sampling::TRUTH);
        for pixel in 0..TILE * TILE {
            let (xs, ys) = p.pixel(pixel % TILE, pixel / TILE);
            let mut seen = [false; 64];
            for (x, y) in xs.iter().zip(ys) {
                seen[(y * 8.0) as usize * 8 + (x * 8.0) as usize] = true;
            }
            assert!(seen.iter().all(|&s| s));
        }
    }

    #[test]
    fn one_sample_is_the_middle_and_seeds_differ() {
        let p = Pattern::new(Sampling::MIDDLE);
        assert_eq!(p.pixel(5, 7), (&[0.5f32][..], &[0.5f32][..]));
        let [a, b] = [1, 2].map(|seed| Pattern::new(Sampling { side: 4, seed }).x);
        assert_ne!(a, b);
    }
}
