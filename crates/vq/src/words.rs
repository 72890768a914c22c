//! Words as the search reads them, and the bounds that rule most of them out.

use crate::distance::{LANES, Lanes, Registers};
use crate::sketch::{PARTS, Sketch, Sketcher};
use pulp::Simd;

/// Sixteen sketches side by side.
#[derive(Clone, Copy)]
pub(crate) struct Block {
    /// Squared lengths; infinite behind the last sketch.
    squares: Lanes,
    parts: [Lanes; PARTS],
}

/// Sketches in blocks.
pub(crate) struct Blocks {
    pub(crate) blocks: Vec<Block>,
    /// The longest sketch.
    pub(crate) reach: f32,
}

impl Blocks {
    pub(crate) fn new(sketches: impl ExactSizeIterator<Item = Sketch>) -> Self {
        let empty =
            Block { squares: Lanes([f32::INFINITY; LANES]), parts: [Lanes([0.0; LANES]); PARTS] };
        let mut blocks = vec![empty; sketches.len().div_ceil(LANES)];
        let mut reach = 0f32;
        for (i, sketch) in sketches.enumerate() {
            let block = &mut blocks[i / LANES];
            let square = square(&sketch);
            block.squares.0[i % LANES] = square;
            reach = reach.max(square);
            for (part, v) in block.parts.iter_mut().zip(sketch) {
                part.0[i % LANES] = v;
            }
        }
        Self { blocks, reach: reach.sqrt() }
    }
}

/// The boxes of sixteen blocks.
#[derive(Clone, Copy)]
pub(crate) struct Boxes {
    low: [Lanes; PARTS],
    high: [Lanes; PARTS],
}

/// Sketches in blocks of neighbours.
pub(crate) struct Gathered {
    pub(crate) sketches: Blocks,
    /// Which sketches are in each block, in order.
    pub(crate) numbers: Vec<u32>,
    /// The boxes of the blocks; infinitely far behind the last one.
    pub(crate) boxes: Vec<Boxes>,
}

impl Gathered {
    pub(crate) fn new(sketches: &[Sketch]) -> Self {
        let mut numbers: Vec<u32> = (0..sketches.len() as u32).collect();
        gather(&mut numbers, sketches);
        let far = [Lanes([f32::INFINITY; LANES]); PARTS];
        let count = numbers.len().div_ceil(LANES).div_ceil(LANES);
        let mut boxes = vec![Boxes { low: far, high: far }; count];
        for (b, block) in numbers.chunks(LANES).enumerate() {
            let all = &mut boxes[b / LANES];
            for (j, (low, high)) in all.low.iter_mut().zip(&mut all.high).enumerate() {
                let values = block.iter().map(|&i| sketches[i as usize][j]);
                low.0[b % LANES] = values.clone().fold(f32::INFINITY, f32::min);
                high.0[b % LANES] = values.fold(f32::NEG_INFINITY, f32::max);
            }
        }
        let sketches = Blocks::new(numbers.iter().map(|&i| sketches[i as usize]));
        Self { sketches, numbers, boxes }
    }
}

/// Words in a row, and their sketches.
pub(crate) struct Words {
    /// Lanes of a word.
    pub(crate) width: usize,
    pub(crate) values: Vec<Lanes>,
    pub(crate) gathered: Gathered,
}

impl Words {
    pub(crate) fn new(width: usize, values: Vec<Lanes>, sketcher: &Sketcher) -> Self {
        let gathered = Gathered::new(&sketcher.sketches(&values));
        Self { width, values, gathered }
    }

    pub(crate) fn len(&self) -> usize {
        self.values.len() / self.width
    }

    #[inline(always)]
    pub(crate) fn word(&self, i: usize) -> &[Lanes] {
        &self.values[i * self.width..][..self.width]
    }
}

/// Orders sketches so that blocks of neighbours are small: halves across the longest side of their
/// box, down to blocks.
fn gather(numbers: &mut [u32], sketches: &[Sketch]) {
    if numbers.len() <= LANES {
        numbers.sort_unstable();
        return;
    }
    let part = |i: u32, j: usize| sketches[i as usize][j];
    let side = |j: usize| {
        let values = numbers.iter().map(|&i| part(i, j));
        values.clone().fold(f32::NEG_INFINITY, f32::max) - values.fold(f32::INFINITY, f32::min)
    };
    let longest = (0..PARTS).max_by(|&a, &b| side(a).total_cmp(&side(b))).unwrap_or(0);
    let half = (numbers.len() / 2).next_multiple_of(LANES).min(numbers.len() - 1);
    numbers.select_nth_unstable_by(half, |&a, &b| {
        part(a, longest).total_cmp(&part(b, longest)).then(a.cmp(&b))
    });
    let (low, high) = numbers.split_at_mut(half);
    gather(low, sketches);
    gather(high, sketches);
}

/// Squared length.
#[inline(always)]
pub(crate) fn square(sketch: &Sketch) -> f32 {
    sketch.iter().map(|v| v * v).sum()
}

/// Squared distances of a sketch from sixteen boxes: no more than from the sketches in them.
#[inline(always)]
pub(crate) fn box_bounds<S: Simd>(simd: S, boxes: &Boxes, sketch: &Sketch) -> Registers<S> {
    let mut sums = Registers::<S>([simd.splat_f32s(0.0); LANES]);
    for (j, &v) in sketch.iter().enumerate() {
        let v = simd.splat_f32s(v);
        let low = Registers::<S>::parts(&boxes.low[j]);
        let high = Registers::<S>::parts(&boxes.high[j]);
        for ((sum, low), high) in sums.0.iter_mut().zip(low).zip(high) {
            let d = simd.sub_f32s(v, simd.min_f32s(simd.max_f32s(v, *low), *high));
            *sum = simd.add_f32s(*sum, simd.mul_f32s(d, d));
        }
    }
    sums
}

/// The squared distances of a sketch, whose parts times −2 are `twice`, from sixteen others, less its
/// own squared length.
#[inline(always)]
pub(crate) fn bounds<S: Simd>(simd: S, block: &Block, twice: &Sketch) -> Registers<S> {
    let mut sums = Registers::new(simd, &block.squares);
    for (part, twice) in block.parts.iter().zip(twice) {
        let twice = simd.splat_f32s(*twice);
        for (sum, part) in sums.0.iter_mut().zip(Registers::<S>::parts(part)) {
            *sum = simd.add_f32s(*sum, simd.mul_f32s(twice, *part));
        }
    }
    sums
}

/// More than what products below the normal range of f32 may be wrong by.
const UNDERFLOW: f32 = 1e-34;

/// A word whose sketch is farther than this (squared) is itself farther than `distance` (squared):
/// rounding errors included.
///
/// `square` is the squared length of the vector's sketch, `reach` the length of the longest other,
/// S the sum of both lengths. Sketches are wrong by 2⁻²² S at most: their distance is at most S too,
/// so its square by 2⁻²¹ S². Ten operations on terms below S² add 10 · 2⁻²⁴ S², and the distance
/// itself is wrong by at most (width + 5) · 2⁻²⁴ of it.
#[inline(always)]
pub(crate) fn limit(distance: f32, width: usize, square: f32, reach: f32) -> f32 {
    let sum = square.sqrt() + reach;
    let relative = (width + 8) as f32 / (1 << 23) as f32;
    distance * (1.0 + relative) + (sum * sum / (1 << 18) as f32 + UNDERFLOW)
}
