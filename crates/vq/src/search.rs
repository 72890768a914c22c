//! The nearest word of each of many vectors, exactly.
//!
//! A first guess gives a distance; words whose bound (see [`crate::sketch`]) is above it are ruled
//! out sixteen at a time, and distances are computed to the few that are left.

use crate::distance::{LANES, squared};
use crate::sketch::Sketch;
use crate::words::{Words, bounds, limit, square};

/// No guess.
pub(crate) const NONE: u32 = u32::MAX;

/// Vectors whose bounds are computed together.
const ROWS: usize = 4;

/// A search among `words` for a chunk of vectors.
pub(crate) struct Search<'a> {
    pub(crate) words: &'a Words,
    /// Padded.
    pub(crate) rows: &'a [f32],
    pub(crate) sketches: &'a [Sketch],
    /// In: a guess or [`NONE`]. Out: the nearest word, the lowest of several.
    pub(crate) indices: &'a mut [u32],
    /// Out: squared distances.
    pub(crate) distances: &'a mut [f32],
}

impl Search<'_> {
    /// Distances that were computed.
    #[inline(always)]
    pub(crate) fn run(self) -> u64 {
        let blocks = &self.words.sketches.blocks;
        let mut buffer = vec![[[0f32; LANES]; ROWS]; blocks.len()];
        let mut computed = 0;
        let width = self.words.width;
        for (group, sketches) in self.sketches.chunks(ROWS).enumerate() {
            let padded = std::array::from_fn(|r| sketches[r.min(sketches.len() - 1)]);
            bounds(blocks, &padded, &mut buffer);
            for (r, sketch) in sketches.iter().enumerate() {
                let i = group * ROWS + r;
                let row = &self.rows[i * width..][..width];
                let guess = self.indices[i];
                let guess = if guess == NONE { lowest(&buffer, r) } else { guess };
                let (index, distance, more) = nearest(self.words, row, sketch, guess, &buffer, r);
                self.indices[i] = index;
                self.distances[i] = distance;
                computed += more;
            }
        }
        computed
    }
}

/// The word with the lowest bound of vector `r`.
#[inline(always)]
fn lowest(buffer: &[[[f32; LANES]; ROWS]], r: usize) -> u32 {
    let mut least = [f32::INFINITY; LANES];
    let mut at = [0u32; LANES];
    for (b, bounds) in (0..).zip(buffer) {
        for l in 0..LANES {
            let below = bounds[r][l] < least[l];
            least[l] = if below { bounds[r][l] } else { least[l] };
            at[l] = if below { b } else { at[l] };
        }
    }
    let mut best = 0;
    for l in 1..LANES {
        if least[l] < least[best] {
            best = l;
        }
    }
    at[best] * LANES as u32 + best as u32
}

/// The nearest word, its squared distance, and the distances that were computed.
#[inline(always)]
fn nearest(
    words: &Words,
    row: &[f32],
    sketch: &Sketch,
    guess: u32,
    buffer: &[[[f32; LANES]; ROWS]],
    r: usize,
) -> (u32, f32, u64) {
    let (mut index, mut distance) = (guess, squared(row, words.word(guess as usize)));
    let (own, reach) = (square(sketch), words.sketches.reach);
    let limit_of = |distance| limit(distance, row.len(), own, reach);
    let mut most = limit_of(distance);
    // Mostly the guess alone is left.
    let mut left = [0u32; LANES];
    for bounds in buffer {
        for l in 0..LANES {
            left[l] += u32::from(bounds[r][l] <= most);
        }
    }
    let mut computed = 1;
    if left.iter().sum::<u32>() > 1 {
        for (b, bounds) in buffer.iter().enumerate() {
            let bounds = &bounds[r];
            if bounds.iter().map(|v| u32::from(*v <= most)).sum::<u32>() == 0 {
                continue;
            }
            for (l, &bound) in bounds.iter().enumerate() {
                let word = (b * LANES + l) as u32;
                if bound > most || word == guess {
                    continue;
                }
                let other = squared(row, words.word(word as usize));
                computed += 1;
                if other < distance || (other == distance && word < index) {
                    (index, distance) = (word, other);
                    most = limit_of(distance);
                }
            }
        }
    }
    (index, distance, computed)
}

impl pulp::WithSimd for Search<'_> {
    type Output = u64;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> u64 {
        self.run()
    }
}
