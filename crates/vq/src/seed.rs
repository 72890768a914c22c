//! The words that training starts from.

use crate::distance::{LANES, squared};
use crate::lloyd::Sample;
use crate::search::Bits;
use crate::words::{Blocks, bounds, limit, square};
use rand::RngExt;
use rand_pcg::Pcg32;

/// Rows that are drawn for each word; that which lowers the distortion most is taken (greedy
/// k-means++, as in D. Arthur's and S. Vassilvitskii's own programs).
const DRAWS: usize = 4;

/// `words` rows, each drawn by its squared distance from those before it, and the distances that
/// were computed. Rows are distinct and no fewer than `words`.
pub(crate) fn plus_plus(sample: Sample, words: usize, random: &mut Pcg32) -> (Vec<u32>, u64) {
    let blocks = Blocks::new(sample.sketches[..sample.len()].iter().copied());
    let mut state = State::new(sample, &blocks);
    let mut chosen = vec![false; sample.len()];
    let mut order = Vec::with_capacity(words);
    let mut trials: [Trial; DRAWS] = Default::default();
    while order.len() < words {
        let draws = if order.is_empty() { 1 } else { DRAWS };
        let mut drawn = 0;
        for trial in &mut trials[..draws] {
            let Some(row) = state.draw(random) else { break };
            trial.row = row;
            pulp::Arch::new().dispatch(Try { state: &state, trial });
            state.computed += trial.computed;
            drawn += 1;
        }
        // The first of equals.
        let best = trials[..drawn].iter().reduce(|a, b| if b.gain > a.gain { b } else { a });
        let row = match best {
            Some(best) => {
                state.take(best);
                best.row
            }
            // Distances of 0 in f32 between rows that differ.
            None => chosen.iter().position(|c| !c).expect("more rows than words") as u32,
        };
        chosen[row as usize] = true;
        order.push(row);
    }
    (order, state.computed)
}

struct State<'a> {
    sample: Sample<'a>,
    blocks: &'a Blocks,
    /// Squared distance of each row to the nearest word so far, in blocks; 0 behind the last row.
    nearest: Vec<[f32; LANES]>,
    /// What the rows of each block add to the distortion.
    errors: Vec<f64>,
    computed: u64,
}

/// What a row would change as a word.
#[derive(Default)]
struct Trial {
    row: u32,
    /// By how much the distortion falls.
    gain: f64,
    /// Rows that come nearer, and their squared distances.
    nearer: Vec<(u32, f32)>,
    computed: u64,
}

impl<'a> State<'a> {
    fn new(sample: Sample<'a>, blocks: &'a Blocks) -> Self {
        // Before the first word all rows are equally far.
        let count = sample.len();
        let far =
            |b: usize| std::array::from_fn(|l| if b * LANES + l < count { f32::MAX } else { 0.0 });
        let nearest = (0..blocks.blocks.len()).map(far).collect();
        let errors = sample.weights.chunks(LANES).map(|w| w.iter().sum()).collect();
        Self { sample, blocks, nearest, errors, computed: 0 }
    }

    /// What row `i` adds to the distortion.
    fn error(&self, i: usize) -> f64 {
        let nearest = self.nearest[i / LANES][i % LANES];
        let nearest = if nearest == f32::MAX { 1.0 } else { f64::from(nearest) };
        nearest * self.sample.weights[i]
    }

    /// A row, drawn by what it adds; `None` if none adds anything.
    fn draw(&self, random: &mut Pcg32) -> Option<u32> {
        let total: f64 = self.errors.iter().sum();
        let mut left = random.random::<f64>() * total;
        let mut last = None;
        for (b, &error) in self.errors.iter().enumerate() {
            // Rounding may leave something behind the last block: then its last row is taken.
            if error <= 0.0 || (left >= error && b + 1 < self.errors.len()) {
                left -= error;
                continue;
            }
            for i in b * LANES..self.sample.len().min((b + 1) * LANES) {
                let error = self.error(i);
                if error > 0.0 {
                    last = Some(i as u32);
                    if left < error {
                        return last;
                    }
                    left -= error;
                }
            }
            if last.is_some() {
                return last;
            }
        }
        (0..self.sample.len()).rev().find(|&i| self.error(i) > 0.0).map(|i| i as u32)
    }

    fn take(&mut self, trial: &Trial) {
        for &(i, distance) in &trial.nearer {
            self.nearest[i as usize / LANES][i as usize % LANES] = distance;
        }
        let mut before = usize::MAX;
        for &(i, _) in &trial.nearer {
            let b = i as usize / LANES;
            if b != before {
                let rows = b * LANES..self.sample.len().min((b + 1) * LANES);
                self.errors[b] = rows.map(|i| self.error(i)).sum();
                before = b;
            }
        }
    }
}

/// Fills in a trial, for `pulp`.
struct Try<'a> {
    state: &'a State<'a>,
    trial: &'a mut Trial,
}

impl pulp::WithSimd for Try<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) {
        let Self { state, trial } = self;
        let sample = state.sample;
        let sketch = sample.sketches[trial.row as usize];
        let word = sample.rows.row(trial.row as usize);
        trial.nearer.clear();
        (trial.gain, trial.computed) = (0.0, 0);
        // What `limit` adds at distance 0, and what it multiplies distances by.
        let (own, reach) = (square(&sketch), state.blocks.reach);
        let more = limit(0.0, word.len(), own, reach) - own;
        let factor = limit(1.0, word.len(), 0.0, 0.0);
        let twice = sketch.map(|v| -2.0 * v);
        for (b, (block, nearest)) in state.blocks.blocks.iter().zip(&state.nearest).enumerate() {
            let bounds = bounds(simd, block, &twice).lanes().0;
            let mut left = 0u32;
            for (l, (bound, nearest)) in bounds.iter().zip(nearest).enumerate() {
                left |= if *bound <= nearest * factor + more { 1 << l } else { 0 };
            }
            for l in Bits(left) {
                let i = b * LANES + l;
                if i >= sample.len() {
                    break;
                }
                let distance = squared(simd, sample.rows.row(i), word);
                trial.computed += 1;
                if distance < nearest[l] {
                    trial.gain += state.error(i) - f64::from(distance) * sample.weights[i];
                    trial.nearer.push((i as u32, distance));
                }
            }
        }
    }
}
