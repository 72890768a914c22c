//! Eight numbers a vector, whose distances are never more than those of the vectors.
//!
//! Seven are coordinates along orthonormal directions, those in which the vectors differ most; the
//! eighth is the length of what these leave. By the triangle inequality in that rest, the distance
//! of two sketches bounds the distance of their vectors from below. Neighbouring texels are alike:
//! of 512 words, on average less than two are not ruled out so.

use crate::distance::{LANES, Lanes};
use crate::rows::Rows;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;
use rayon::prelude::*;

/// Numbers of a sketch.
pub(crate) const PARTS: usize = 8;

/// A sketched vector.
pub(crate) type Sketch = [f32; PARTS];

/// Rows that directions are found from.
const SAMPLE: usize = 2048;

/// Rounds of the orthogonal iteration: directions need not be exact, only orthonormal.
const ROUNDS: usize = 12;

/// How sketches are made.
pub(crate) struct Sketcher {
    mean: Vec<f64>,
    /// By dimension, the directions' values; the last is 0.
    directions: Vec<[f64; PARTS]>,
}

impl Sketcher {
    /// For vectors like the first `count` of `rows`.
    pub(crate) fn new(rows: &Rows, count: usize) -> Self {
        let (width, count) = (rows.width * LANES, count.min(SAMPLE));
        let mut mean = vec![0f64; width];
        for i in 0..count {
            mean.iter_mut().zip(numbers(rows.row(i))).for_each(|(m, v)| *m += v);
        }
        mean.iter_mut().for_each(|m| *m /= count.max(1) as f64);
        let mut sketcher = Self { mean, directions: vec![[0.0; PARTS]; width] };
        let mut covariance = vec![0f64; width * width];
        pulp::Arch::new().dispatch(Covariance {
            rows,
            count,
            mean: &sketcher.mean,
            out: &mut covariance,
        });
        sketcher.find_directions(&covariance);
        sketcher
    }

    /// Orthogonal iteration from random directions (G. Golub, C. Van Loan, "Matrix Computations",
    /// section 8.2.4).
    fn find_directions(&mut self, covariance: &[f64]) {
        let width = self.mean.len();
        let mut random = Pcg32::seed_from_u64(0);
        let mut columns: [Vec<f64>; PARTS - 1] =
            std::array::from_fn(|_| (0..width).map(|_| random.random::<f64>() - 0.5).collect());
        for _ in 0..ROUNDS {
            for column in &mut columns {
                let times = |row: &[f64]| row.iter().zip(&*column).map(|(a, b)| a * b).sum();
                *column = covariance.chunks_exact(width).map(times).collect();
            }
            // Twice is enough: once more where cancellation spoilt the first.
            orthonormalise(&mut columns);
            orthonormalise(&mut columns);
        }
        for (j, column) in columns.iter().enumerate() {
            for (d, &v) in self.directions.iter_mut().zip(column) {
                d[j] = v;
            }
        }
    }

    /// The sketch of a padded vector.
    #[inline(always)]
    fn sketch(&self, row: &[Lanes]) -> Sketch {
        let mut parts = [0f64; PARTS];
        let mut square = 0f64;
        for ((v, m), directions) in numbers(row).zip(&self.mean).zip(&self.directions) {
            let v = v - m;
            square += v * v;
            for j in 0..PARTS {
                parts[j] += v * directions[j];
            }
        }
        let seen: f64 = parts.iter().map(|p| p * p).sum();
        parts[PARTS - 1] = (square - seen).max(0.0).sqrt();
        parts.map(|p| p as f32)
    }

    /// The sketches of padded vectors, one after the other.
    pub(crate) fn sketches(&self, values: &[Lanes]) -> Vec<Sketch> {
        let width = self.mean.len() / LANES;
        let mut out = vec![[0.0; PARTS]; values.len() / width];
        out.par_chunks_mut(1024).zip(values.par_chunks(1024 * width)).for_each(|(out, values)| {
            pulp::Arch::new().dispatch(SketchAll { sketcher: self, values, out });
        });
        out
    }
}

/// The numbers of a padded vector.
#[inline(always)]
fn numbers(row: &[Lanes]) -> impl Iterator<Item = f64> {
    row.iter().flat_map(|lanes| lanes.0).map(f64::from)
}

/// Columns of almost nothing become 0: bounds hold with fewer directions too.
fn orthonormalise(columns: &mut [Vec<f64>]) {
    for j in 0..columns.len() {
        let (before, rest) = columns.split_at_mut(j);
        let column = &mut rest[0];
        let length = |c: &[f64]| c.iter().map(|v| v * v).sum::<f64>().sqrt();
        let whole = length(column);
        for other in before.iter() {
            let along: f64 = column.iter().zip(other).map(|(a, b)| a * b).sum();
            column.iter_mut().zip(other).for_each(|(a, b)| *a -= along * b);
        }
        let left = length(column);
        let scale = if left > 1e-10 * whole && left > 1e-150 { 1.0 / left } else { 0.0 };
        column.iter_mut().for_each(|v| *v *= scale);
    }
}

/// Sums of products about the mean, for `pulp`.
struct Covariance<'a> {
    rows: &'a Rows,
    count: usize,
    mean: &'a [f64],
    out: &'a mut [f64],
}

impl pulp::WithSimd for Covariance<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let width = self.rows.width * LANES;
        let mut centred = vec![0f64; width];
        for i in 0..self.count {
            for ((c, v), m) in centred.iter_mut().zip(numbers(self.rows.row(i))).zip(self.mean) {
                *c = v - m;
            }
            for (a, out) in centred.iter().zip(self.out.chunks_exact_mut(width)) {
                let out = out.as_chunks_mut::<LANES>().0;
                for (out, b) in out.iter_mut().zip(centred.as_chunks::<LANES>().0) {
                    for l in 0..LANES {
                        out[l] += a * b[l];
                    }
                }
            }
        }
    }
}

/// [`Sketcher::sketch`] of many, for `pulp`.
struct SketchAll<'a> {
    sketcher: &'a Sketcher,
    values: &'a [Lanes],
    out: &'a mut [Sketch],
}

impl pulp::WithSimd for SketchAll<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let width = self.sketcher.mean.len() / LANES;
        for (out, row) in self.out.iter_mut().zip(self.values.chunks_exact(width)) {
            *out = self.sketcher.sketch(row);
        }
    }
}
