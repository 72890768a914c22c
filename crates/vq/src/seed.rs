//! The words that training starts from.

use crate::distance::{LANES, Lanes, squared};
use crate::lloyd::Sample;
use crate::search::Bits;
use crate::words::{Gathered, bounds, box_bounds, limit, square};
use rand::RngExt;
use rand_pcg::Pcg32;

/// Rows that are drawn for each word; that which lowers the distortion most is taken (greedy
/// k-means++, as in D. Arthur's and S. Vassilvitskii's own programs).
const DRAWS: usize = 4;

/// `words` rows, each drawn by its squared distance from those before it, and the distances that
/// were computed. Rows are distinct and no fewer than `words`.
pub(crate) fn plus_plus(sample: Sample, words: usize, random: &mut Pcg32) -> (Vec<u32>, u64) {
    let gathered = Gathered::new(&sample.sketches[..sample.len()]);
    let mut state = State::new(sample, &gathered);
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

/// Rows are counted by their place in the blocks.
struct State<'a> {
    sample: Sample<'a>,
    gathered: &'a Gathered,
    /// Squared distance of each row to the nearest word so far, in blocks; 0 behind the last row.
    nearest: Vec<[f32; LANES]>,
    /// The largest of each block, by sixteen.
    farthest: Vec<Lanes>,
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
    /// Places of rows that come nearer, and their squared distances.
    nearer: Vec<(u32, f32)>,
    computed: u64,
}

impl<'a> State<'a> {
    fn new(sample: Sample<'a>, gathered: &'a Gathered) -> Self {
        // Before the first word all rows are equally far.
        let count = sample.len();
        let blocks = count.div_ceil(LANES);
        let far =
            |b: usize| std::array::from_fn(|l| if b * LANES + l < count { f32::MAX } else { 0.0 });
        let nearest = (0..blocks).map(far).collect();
        let farthest = vec![Lanes([0.0; LANES]); blocks.div_ceil(LANES)];
        let mut state =
            Self { sample, gathered, nearest, farthest, errors: vec![0.0; blocks], computed: 0 };
        (0..blocks).for_each(|b| state.update(b));
        state
    }

    fn row(&self, place: usize) -> u32 {
        self.gathered.numbers[place]
    }

    /// What the row at a place adds to the distortion.
    fn error(&self, place: usize) -> f64 {
        let nearest = self.nearest[place / LANES][place % LANES];
        let nearest = if nearest == f32::MAX { 1.0 } else { f64::from(nearest) };
        nearest * self.sample.weights[self.row(place) as usize]
    }

    /// Sums up a block.
    fn update(&mut self, b: usize) {
        let places = b * LANES..self.sample.len().min((b + 1) * LANES);
        self.errors[b] = places.map(|i| self.error(i)).sum();
        self.farthest[b / LANES].0[b % LANES] = self.nearest[b].into_iter().fold(0.0, f32::max);
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
                    last = Some(self.row(i));
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
        (0..self.sample.len()).rev().find(|&i| self.error(i) > 0.0).map(|i| self.row(i))
    }

    fn take(&mut self, trial: &Trial) {
        for &(i, distance) in &trial.nearer {
            self.nearest[i as usize / LANES][i as usize % LANES] = distance;
        }
        // Places ascend.
        for same in trial.nearer.chunk_by(|a, b| a.0 as usize / LANES == b.0 as usize / LANES) {
            self.update(same[0].0 as usize / LANES);
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
        let (own, reach) = (square(&sketch), state.gathered.sketches.reach);
        let more = limit(0.0, word.len(), own, reach);
        let factor = limit(1.0, word.len(), 0.0, 0.0);
        let twice = sketch.map(|v| -2.0 * v);
        let boxes = state.gathered.boxes.iter().zip(&state.farthest);
        for (first, (boxes, farthest)) in (0..).step_by(LANES).zip(boxes) {
            let bounds = box_bounds(simd, boxes, &sketch).lanes();
            for b in Bits(at_most(&bounds.0, &farthest.0, factor, more)) {
                let (b, nearest) = (first + b, &state.nearest[first + b]);
                let bounds = self::bounds(simd, &state.gathered.sketches.blocks[b], &twice).lanes();
                for l in Bits(at_most(&bounds.0, nearest, factor, more - own)) {
                    let place = b * LANES + l;
                    let row = state.row(place) as usize;
                    let distance = squared(simd, sample.rows.row(row), word);
                    trial.computed += 1;
                    if distance < nearest[l] {
                        let now = f64::from(distance) * sample.weights[row];
                        trial.gain += state.error(place) - now;
                        trial.nearer.push((place as u32, distance));
                    }
                }
            }
        }
    }
}

/// Bit `l` says whether bound `l` is at most the distance `l`, times `factor` and `more`.
#[inline(always)]
fn at_most(bounds: &[f32; LANES], distances: &[f32; LANES], factor: f32, more: f32) -> u32 {
    let mut bits = 0;
    for l in 0..LANES {
        bits |= if bounds[l] <= distances[l] * factor + more { 1 << l } else { 0 };
    }
    bits
}
