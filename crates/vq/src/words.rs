//! Words as the search reads them, and the bounds that rule most of them out.

use crate::distance::LANES;
use crate::sketch::{PARTS, Sketch, Sketcher};

/// Sixteen sketches side by side.
#[derive(Clone, Copy)]
pub(crate) struct Block {
    /// Squared lengths; infinite behind the last sketch.
    squares: [f32; LANES],
    parts: [[f32; LANES]; PARTS],
}

/// Sketches in blocks.
pub(crate) struct Blocks {
    pub(crate) blocks: Vec<Block>,
    /// The longest sketch.
    pub(crate) reach: f32,
}

impl Blocks {
    pub(crate) fn new(sketches: &[Sketch]) -> Self {
        let empty = Block { squares: [f32::INFINITY; LANES], parts: [[0.0; LANES]; PARTS] };
        let mut blocks = vec![empty; sketches.len().div_ceil(LANES)];
        let mut reach = 0f32;
        for (i, sketch) in sketches.iter().enumerate() {
            let block = &mut blocks[i / LANES];
            let square = square(sketch);
            block.squares[i % LANES] = square;
            reach = reach.max(square);
            for (part, &v) in block.parts.iter_mut().zip(sketch) {
                part[i % LANES] = v;
            }
        }
        Self { blocks, reach: reach.sqrt() }
    }
}

/// Squared length.
#[inline(always)]
pub(crate) fn square(sketch: &Sketch) -> f32 {
    sketch.iter().map(|v| v * v).sum()
}

/// Words in a row, and their sketches.
pub(crate) struct Words {
    pub(crate) width: usize,
    /// Padded.
    pub(crate) values: Vec<f32>,
    pub(crate) sketches: Blocks,
}

impl Words {
    pub(crate) fn new(width: usize, values: Vec<f32>, sketcher: &Sketcher) -> Self {
        let sketches = Blocks::new(&sketcher.sketches(&values));
        Self { width, values, sketches }
    }

    pub(crate) fn len(&self) -> usize {
        self.values.len() / self.width
    }

    #[inline(always)]
    pub(crate) fn word(&self, i: usize) -> &[f32] {
        &self.values[i * self.width..][..self.width]
    }
}

/// For each of `R` vectors and every word: the squared distance of their sketches, less the squared
/// length of the vector's. Each operation is one of the machine's, in the order of the parts.
#[inline(always)]
pub(crate) fn bounds<const R: usize>(
    blocks: &[Block],
    sketches: &[Sketch; R],
    out: &mut [[[f32; LANES]; R]],
) {
    let twice = sketches.map(|s| s.map(|v| -2.0 * v));
    for (block, out) in blocks.iter().zip(out) {
        let mut sums = [block.squares; R];
        for (j, part) in block.parts.iter().enumerate() {
            for (sums, twice) in sums.iter_mut().zip(&twice) {
                for l in 0..LANES {
                    sums[l] += twice[j] * part[l];
                }
            }
        }
        *out = sums;
    }
}

/// More than what products below the normal range of f32 may be wrong by.
const UNDERFLOW: f32 = 1e-34;

/// A word whose bound is above this is farther than `distance` (squared): rounding errors included.
///
/// With S the sum of both lengths, sketches are wrong by 2⁻²² S at most: the vectors' distance is at
/// most S too, so its square by 2⁻²¹ S². Ten operations on terms below S² add 10 · 2⁻²⁴ S², and the
/// distance itself is wrong by at most (width / 16 + 5) · 2⁻²⁴ of it.
#[inline(always)]
pub(crate) fn limit(distance: f32, width: usize, square: f32, reach: f32) -> f32 {
    let sum = square.sqrt() + reach;
    let relative = (width / LANES + 8) as f32 / (1 << 23) as f32;
    distance * (1.0 + relative) + sum * sum / (1 << 18) as f32 + UNDERFLOW - square
}
