//! One round of the generalised Lloyd algorithm (Y. Linde, A. Buzo, R. Gray, "An algorithm for
//! vector quantizer design", IEEE Trans. Commun. 28, 1980): vectors to words, words to means.
//!
//! Rows are taken in chunks whose number depends on the data alone; their sums, in f64, are added
//! in order: threads change nothing.

use crate::distance::{LANES, Lanes, squared};
use crate::rows::Rows;
use crate::search::Search;
use crate::sketch::Sketch;
use crate::words::Words;
use rayon::prelude::*;

/// What training holds of the vectors, or of the first of them.
#[derive(Clone, Copy)]
pub(crate) struct Sample<'a> {
    pub(crate) rows: &'a Rows,
    pub(crate) sketches: &'a [Sketch],
    /// One a row: their number says how many rows there are.
    pub(crate) weights: &'a [f64],
}

impl<'a> Sample<'a> {
    /// The first `count` rows.
    pub(crate) fn first(self, count: usize) -> Self {
        Self { weights: &self.weights[..count], ..self }
    }

    pub(crate) fn len(self) -> usize {
        self.weights.len()
    }

    /// Padded values of all rows.
    fn values(self) -> &'a [Lanes] {
        &self.rows.values[..self.len() * self.rows.width]
    }

    /// Rows of a chunk: enough that the sums of all chunks cost little beside the rows.
    fn chunk(self, words: usize) -> usize {
        (self.len() / 32).max(4 * words).max(1024)
    }
}

/// Which word each row has, and how far it is.
pub(crate) struct Assignment {
    pub(crate) indices: Vec<u32>,
    /// Squared distances.
    pub(crate) distances: Vec<f32>,
}

/// Sums over the rows of each word.
pub(crate) struct Sums {
    /// Weighted sums of the vectors, `width` a word.
    vectors: Vec<Lanes<f64>>,
    /// Weights.
    weights: Vec<f64>,
    /// Weighted squared distances of all rows.
    pub(crate) error: f64,
    /// Distances that were computed.
    pub(crate) computed: u64,
}

/// A chunk of a round: nearest words, then sums while the rows are at hand. For `pulp`.
struct Chunk<'a> {
    search: Search<'a>,
    weights: &'a [f64],
}

impl pulp::WithSimd for Chunk<'_> {
    type Output = Sums;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) -> Sums {
        let Self { mut search, weights } = self;
        let computed = search.run(simd);
        let Search { words, rows, indices, .. } = search;
        let (width, count) = (words.width, words.len());
        let mut sums = Sums {
            vectors: vec![Lanes([0.0; LANES]); count * width],
            weights: vec![0.0; count],
            error: 0.0,
            computed,
        };
        // Lane by lane over all rows: a sum for each row would have to be folded.
        let mut errors = [0f64; LANES];
        for ((row, &index), &weight) in rows.chunks_exact(width).zip(&*indices).zip(weights) {
            let index = index as usize;
            sums.weights[index] += weight;
            let to = &mut sums.vectors[index * width..][..width];
            for ((to, row), word) in to.iter_mut().zip(row).zip(words.word(index)) {
                for (l, error) in errors.iter_mut().enumerate() {
                    let v = f64::from(row.0[l]);
                    let d = v - f64::from(word.0[l]);
                    *error += weight * (d * d);
                    to.0[l] += weight * v;
                }
            }
        }
        sums.error = errors.iter().sum();
        sums
    }
}

impl Assignment {
    /// Finds the nearest words of the sample; earlier indices are guesses.
    pub(crate) fn pass(&mut self, sample: Sample, words: &Words) -> Sums {
        let (count, chunk) = (sample.len(), sample.chunk(words.len()));
        let parts: Vec<Sums> = sample
            .values()
            .par_chunks(chunk * words.width)
            .zip(sample.sketches[..count].par_chunks(chunk))
            .zip(self.indices[..count].par_chunks_mut(chunk))
            .zip(self.distances[..count].par_chunks_mut(chunk))
            .zip(sample.weights.par_chunks(chunk))
            .map(|((((rows, sketches), indices), distances), weights)| {
                let search = Search { words, rows, sketches, indices, distances };
                pulp::Arch::new().dispatch(Chunk { search, weights })
            })
            .collect();
        let mut parts = parts.into_iter();
        let mut all = parts.next().expect("a sample is not empty");
        for part in parts {
            for (a, b) in all.vectors.iter_mut().zip(&part.vectors) {
                a.0.iter_mut().zip(&b.0).for_each(|(a, b)| *a += b);
            }
            all.weights.iter_mut().zip(&part.weights).for_each(|(a, b)| *a += b);
            all.error += part.error;
            all.computed += part.computed;
        }
        all
    }

    /// The means of the words' rows, padded. Words without rows move to the rows that add most to
    /// the distortion: each lowers it by as much.
    pub(crate) fn means(&self, sample: Sample, sums: &Sums, words: &Words) -> Vec<Lanes> {
        let width = words.width;
        let mut values = words.values.clone();
        let mut unused = Vec::new();
        for (w, word) in values.chunks_exact_mut(width).enumerate() {
            let weight = sums.weights[w];
            if weight > 0.0 {
                let sum = &sums.vectors[w * width..][..width];
                for (word, sum) in word.iter_mut().zip(sum) {
                    *word = Lanes(sum.0.map(|s| (s / weight) as f32));
                }
            } else {
                unused.push(w);
            }
        }
        if !unused.is_empty() {
            let error = |i: u32| f64::from(self.distances[i as usize]) * sample.weights[i as usize];
            let mut worst: Vec<u32> =
                (0..sample.len() as u32).filter(|&i| error(i) > 0.0).collect();
            worst.sort_unstable_by(|&a, &b| error(b).total_cmp(&error(a)).then(a.cmp(&b)));
            for (w, i) in unused.into_iter().zip(worst) {
                values[w * width..][..width].copy_from_slice(sample.rows.row(i as usize));
            }
        }
        values
    }

    /// Moves each mean to the nearest of its rows, the first of several (paper 004, section 4.1.2).
    /// Returns the distances that were computed.
    pub(crate) fn snap(&self, sample: Sample, means: &mut [Lanes]) -> u64 {
        let width = sample.rows.width;
        let count = means.len() / width;
        let chunk = sample.chunk(count);
        let parts: Vec<Vec<(f32, u32)>> = sample
            .values()
            .par_chunks(chunk * width)
            .zip(self.indices[..sample.len()].par_chunks(chunk))
            .map(|(rows, indices)| {
                pulp::Arch::new().dispatch(NearestRows { means, rows, indices, width })
            })
            .collect();
        for (w, mean) in means.chunks_exact_mut(width).enumerate() {
            let candidates = (0..).zip(&parts).map(|(c, p)| (p[w].0, c * chunk, p[w].1));
            let best = candidates.reduce(|a, b| if b.0 < a.0 { b } else { a });
            if let Some((distance, start, i)) = best
                && distance < f32::INFINITY
            {
                mean.copy_from_slice(sample.rows.row(start + i as usize));
            }
        }
        sample.len() as u64
    }
}

/// For each word, the squared distance and number of the row of a chunk that is nearest to its mean;
/// infinite without rows. For `pulp`.
struct NearestRows<'a> {
    means: &'a [Lanes],
    rows: &'a [Lanes],
    indices: &'a [u32],
    width: usize,
}

impl pulp::WithSimd for NearestRows<'_> {
    type Output = Vec<(f32, u32)>;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) -> Self::Output {
        let Self { means, rows, indices, width } = self;
        let mut nearest = vec![(f32::INFINITY, 0); means.len() / width];
        for ((i, row), &index) in (0..).zip(rows.chunks_exact(width)).zip(indices) {
            let index = index as usize;
            let distance = squared(simd, row, &means[index * width..][..width]);
            if distance < nearest[index].0 {
                nearest[index] = (distance, i);
            }
        }
        nearest
    }
}
