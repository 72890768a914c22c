//! From vectors to a codebook.

use crate::codebook::Codebook;
use crate::distance::Lanes;
use crate::error::VqError;
use crate::lloyd::{Assignment, Sample};
use crate::options::{Centers, Seeding, TrainOptions};
use crate::rows::{Distinct, Rows};
use crate::search::NONE;
use crate::seed::plus_plus;
use crate::sketch::Sketcher;
use crate::vectors::Vectors;
use crate::words::Words;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;

/// What a training made.
#[derive(Clone, Debug, PartialEq)]
pub struct Training {
    /// The words: never more than there are distinct vectors that weigh something.
    pub codebook: Codebook,
    /// The nearest word of each vector, the lowest of several.
    pub indices: Vec<u32>,
    /// Weighted mean of the squared distances of vectors and their words.
    pub distortion: f64,
    /// The distortion after each assignment of all vectors. With [`Centers::Mean`] it never rises;
    /// with [`Centers::Nearest`] rounds of means come first, and the last round may not be kept.
    pub history: Vec<f64>,
    /// Distances of whole vectors that were computed, samples and seeding included. Without bounds
    /// a round would take one a distinct vector and word.
    pub distances: u64,
}

// Measured with 150,000 blocks of leaf and bark textures in CIELab and 512 words: smaller samples
// start sooner, but end in worse words.

/// Rows of the smallest sample, for each word, at least.
const SAMPLE_ROWS: usize = 64;

/// How many times larger the next sample is.
const SAMPLE_STEP: usize = 2;

/// Rounds over a sample at most.
const SAMPLE_ROUNDS: usize = 8;

/// A round over a sample is the last if it lowered the distortion by less than this share.
const SAMPLE_TOLERANCE: f64 = 4e-3;

/// Trains a codebook. `weights` are one a vector, finite and ≥ 0, not all 0; none are all 1. Equal
/// vectors are merged first.
///
/// Rounds over a sample of the vectors, then over larger ones, come before rounds over all of them:
/// means of a sample are nearly those of all. Results are the same on any machine, with any number of
/// threads.
///
/// # Errors
/// [`VqError::Option`], [`VqError::Empty`] without vectors, [`VqError::WeightCount`],
/// [`VqError::Weight`] for the first bad one, [`VqError::NoWeight`].
pub fn train(
    vectors: &Vectors,
    weights: Option<&[f32]>,
    options: &TrainOptions,
) -> Result<Training, VqError> {
    options.validate()?;
    check(vectors, weights)?;
    let distinct = Distinct::new(vectors, weights, options.seed);
    let heavy = distinct.heavy();
    let mut run = Run::new(&distinct, options);
    if heavy <= options.codewords {
        run.exact();
    } else {
        run.rounds();
    }
    // Vectors that weigh nothing had no say, but get a word.
    let (rows, width) = (&distinct.rows, distinct.rows.width);
    let light = Rows { width, values: rows.values[heavy * width..].to_vec() };
    let mut indices = run.best.indices;
    indices.truncate(heavy);
    indices.extend(crate::assign::nearest(&run.best.words, &light.values, &run.sketcher));
    let dimension = vectors.dimension();
    let words = run.best.words.values.chunks_exact(width);
    let words = words.flat_map(|w| w.iter().flat_map(|lanes| lanes.0).take(dimension));
    Ok(Training {
        codebook: Codebook::new(dimension, words.collect())?,
        indices: distinct.row_of.iter().map(|&r| indices[r as usize]).collect(),
        distortion: run.best.distortion,
        history: run.history,
        distances: run.computed,
    })
}

fn check(vectors: &Vectors, weights: Option<&[f32]>) -> Result<(), VqError> {
    if vectors.is_empty() {
        return Err(VqError::Empty);
    }
    let Some(weights) = weights else { return Ok(()) };
    if weights.len() != vectors.len() {
        return Err(VqError::WeightCount { expected: vectors.len(), got: weights.len() });
    }
    if let Some(row) = weights.iter().position(|w| !(w.is_finite() && *w >= 0.0)) {
        return Err(VqError::Weight { row, value: weights[row] });
    }
    if weights.iter().all(|w| *w == 0.0) {
        return Err(VqError::NoWeight(weights.len()));
    }
    Ok(())
}

/// The best codebook so far.
struct Best {
    words: Words,
    /// Of the rows that weigh something.
    indices: Vec<u32>,
    distortion: f64,
}

/// A training under way.
struct Run<'a> {
    distinct: &'a Distinct,
    options: &'a TrainOptions,
    sketcher: Sketcher,
    assignment: Assignment,
    best: Best,
    history: Vec<f64>,
    computed: u64,
}

impl<'a> Run<'a> {
    fn new(distinct: &'a Distinct, options: &'a TrainOptions) -> Self {
        let heavy = distinct.heavy();
        let sketcher = Sketcher::new(&distinct.rows, heavy);
        let words = Words::new(distinct.rows.width, Vec::new(), &sketcher);
        Self {
            distinct,
            options,
            sketcher,
            assignment: Assignment { indices: vec![NONE; heavy], distances: vec![0.0; heavy] },
            best: Best { words, indices: Vec::new(), distortion: f64::INFINITY },
            history: Vec::new(),
            computed: 0,
        }
    }

    fn words(&self, values: Vec<Lanes>) -> Words {
        Words::new(self.distinct.rows.width, values, &self.sketcher)
    }

    /// A word for each row.
    fn exact(&mut self) {
        let heavy = self.distinct.heavy();
        let width = self.distinct.rows.width;
        let words = self.words(self.distinct.rows.values[..heavy * width].to_vec());
        self.best = Best { words, indices: (0..heavy as u32).collect(), distortion: 0.0 };
        self.history = vec![0.0];
    }

    fn rounds(&mut self) {
        let distinct = self.distinct;
        let sketches = self.sketcher.sketches(&distinct.rows.values);
        let all = Sample { rows: &distinct.rows, sketches: &sketches, weights: &distinct.weights };
        let mut sizes = vec![all.len()];
        while sizes[sizes.len() - 1] / SAMPLE_STEP >= SAMPLE_ROWS * self.options.codewords {
            sizes.push(sizes[sizes.len() - 1] / SAMPLE_STEP);
        }
        let smallest = all.first(sizes[sizes.len() - 1]);
        let mut words = self.seeds(smallest);
        for &size in sizes[1..].iter().rev() {
            words = self.sample_rounds(all.first(size), words);
        }
        let iterations = self.options.iterations;
        if self.options.centers == Centers::Mean {
            self.full_rounds(all, words, Centers::Mean, iterations);
            return;
        }
        // Words that were vectors from the start would stay near where they began.
        let means = iterations * 3 / 4;
        let (seen, words) = if means > 0 {
            (all, self.full_rounds(all, words, Centers::Mean, means))
        } else {
            (all.first(sizes.get(1).copied().unwrap_or(0)), words)
        };
        let mut values = words.values;
        if seen.len() > 0 {
            self.computed += self.assignment.snap(seen, &mut values);
        }
        self.best.distortion = f64::INFINITY;
        let left = iterations - self.history.len() as u32;
        self.full_rounds(all, self.words(values), Centers::Nearest, left);
    }

    fn seeds(&mut self, sample: Sample) -> Words {
        let mut random = Pcg32::seed_from_u64(self.options.seed ^ 0x5eed);
        let count = self.options.codewords;
        let rows: Vec<u32> = match self.options.seeding {
            Seeding::PlusPlus => {
                let (rows, computed) = plus_plus(sample, count, &mut random);
                self.computed += computed;
                rows
            }
            // Rows are shuffled already: any run of them is a draw.
            Seeding::Random => {
                let start = random.random_range(0..=(sample.len() - count) as u32);
                (start..start + count as u32).collect()
            }
        };
        let values = rows.iter().flat_map(|&r| sample.rows.row(r as usize)).copied().collect();
        self.words(values)
    }

    /// Means after a few rounds over a sample.
    fn sample_rounds(&mut self, sample: Sample, mut words: Words) -> Words {
        let mut before = f64::INFINITY;
        for _ in 0..SAMPLE_ROUNDS {
            let sums = self.assignment.pass(sample, &words);
            self.computed += sums.computed;
            words = self.words(self.assignment.means(sample, &sums, &words));
            if sums.error > before * (1.0 - SAMPLE_TOLERANCE) {
                break;
            }
            before = sums.error;
        }
        words
    }

    /// Rounds over all rows; the best assignment is kept. Returns the words of the next round.
    fn full_rounds(&mut self, all: Sample, words: Words, centers: Centers, most: u32) -> Words {
        let total: f64 = all.weights.iter().sum();
        let mut words = words;
        for _ in 0..most {
            let sums = self.assignment.pass(all, &words);
            self.computed += sums.computed;
            let (before, distortion) = (self.best.distortion, sums.error / total);
            let mut values = self.assignment.means(all, &sums, &words);
            let better = distortion < before;
            // Means that round to no better words are dropped: they never rise.
            if better || centers == Centers::Nearest {
                self.history.push(distortion);
            }
            if centers == Centers::Nearest {
                self.computed += self.assignment.snap(all, &mut values);
            }
            let next = self.words(values);
            if better {
                let indices = self.assignment.indices.clone();
                self.best = Best { words, indices, distortion };
            }
            words = next;
            let gain = before * self.options.tolerance;
            if !better || before - distortion < gain || distortion == 0.0 {
                break;
            }
        }
        words
    }
}
