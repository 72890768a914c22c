//! The nearest word of each of many vectors, exactly.
//!
//! A first guess gives a distance. Blocks of sixteen words whose box (see [`crate::sketch`]) is
//! farther are ruled out sixteen at a time, then the words of those that are left; distances are
//! computed to the one or two words that remain.

use crate::distance::{LANES, Lanes, squared};
use crate::sketch::Sketch;
use crate::words::{Words, bounds, box_bounds, limit, square};
use pulp::Simd;

/// No guess.
pub(crate) const NONE: u32 = u32::MAX;

/// A search among `words` for a chunk of vectors.
pub(crate) struct Search<'a> {
    pub(crate) words: &'a Words,
    pub(crate) rows: &'a [Lanes],
    pub(crate) sketches: &'a [Sketch],
    /// In: a guess or [`NONE`]. Out: the nearest word, the lowest of several.
    pub(crate) indices: &'a mut [u32],
    /// Out: squared distances.
    pub(crate) distances: &'a mut [f32],
}

impl Search<'_> {
    /// Distances that were computed.
    #[inline(always)]
    pub(crate) fn run<S: Simd>(&mut self, simd: S) -> u64 {
        let mut computed = 0;
        for (i, row) in self.rows.chunks_exact(self.words.width).enumerate() {
            let found = nearest(simd, self.words, row, &self.sketches[i], self.indices[i]);
            (self.indices[i], self.distances[i]) = (found.0, found.1);
            computed += found.2;
        }
        computed
    }
}

impl pulp::WithSimd for Search<'_> {
    type Output = u64;

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) -> u64 {
        self.run(simd)
    }
}

/// The nearest word, its squared distance, and the distances that were computed.
#[inline(always)]
fn nearest<S: Simd>(
    simd: S,
    words: &Words,
    row: &[Lanes],
    sketch: &Sketch,
    guess: u32,
) -> (u32, f32, u64) {
    let twice = sketch.map(|v| -2.0 * v);
    let guess = if guess == NONE { near(simd, words, sketch, &twice) } else { guess };
    let (mut index, mut distance) = (guess, squared(simd, row, words.word(guess as usize)));
    let (own, reach) = (square(sketch), words.gathered.sketches.reach);
    let mut most = limit(distance, row.len(), own, reach);
    let mut computed = 1;
    for (first, boxes) in (0..).step_by(LANES).zip(&words.gathered.boxes) {
        for l in Bits(box_bounds(simd, boxes, sketch).at_most(simd, most)) {
            let b = first + l;
            let bounds = bounds(simd, &words.gathered.sketches.blocks[b], &twice);
            for l in Bits(bounds.at_most(simd, most - own)) {
                let word = words.gathered.numbers[b * LANES + l];
                if word == guess {
                    continue;
                }
                let other = squared(simd, row, words.word(word as usize));
                computed += 1;
                if other < distance || (other == distance && word < index) {
                    (index, distance) = (word, other);
                    most = limit(distance, row.len(), own, reach);
                }
            }
        }
    }
    (index, distance, computed)
}

/// The bits that are set, from the lowest.
pub(crate) struct Bits(pub(crate) u32);

impl Iterator for Bits {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let lowest = self.0.trailing_zeros();
        self.0 &= self.0.wrapping_sub(1);
        (lowest < u32::BITS).then_some(lowest as usize)
    }
}

/// A word that is likely to be near: the one with the lowest bound in the block with the nearest box.
#[inline(always)]
fn near<S: Simd>(simd: S, words: &Words, sketch: &Sketch, twice: &Sketch) -> u32 {
    let (mut least, mut block) = (f32::INFINITY, 0);
    for (b, boxes) in words.gathered.boxes.iter().enumerate() {
        let (l, bound) = lowest(&box_bounds(simd, boxes, sketch).lanes());
        if bound < least {
            (least, block) = (bound, b * LANES + l);
        }
    }
    let (l, _) = lowest(&bounds(simd, &words.gathered.sketches.blocks[block], twice).lanes());
    words.gathered.numbers[block * LANES + l]
}

/// The first lowest, and its place.
#[inline(always)]
fn lowest(values: &Lanes) -> (usize, f32) {
    let mut best = 0;
    for l in 1..LANES {
        if values.0[l] < values.0[best] {
            best = l;
        }
    }
    (best, values.0[best])
}
