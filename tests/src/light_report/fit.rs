//! Weights of factors by least squares.

use crate::factors::{FACTORS, Row, Samples};
use nalgebra::{DMatrix, DVector};

/// Not a factor: the sum is multiplied by the hotspot's.
pub(crate) const PRODUCT: usize = FACTORS.len();

/// A weighted sum of a constant and some factors.
pub(crate) struct Fit {
    which: Vec<usize>,
    weights: DVector<f64>,
}

impl Fit {
    /// Fitted to every second sun.
    pub(crate) fn of(samples: &Samples, which: &[usize]) -> Self {
        let n = which.iter().filter(|i| **i != PRODUCT).count() + 1;
        let (mut square, mut right) = (DMatrix::zeros(n, n), DVector::zeros(n));
        for row in samples.rows.iter().step_by(2).flatten() {
            let x = regressors(row, which);
            square += &x * x.transpose();
            right += &x * row[FACTORS.len()];
        }
        // A factor that never varies gets no weight.
        let weights =
            square.svd(true, true).solve(&right, 1e-9).unwrap_or_else(|_| DVector::zeros(n));
        Self { which: which.to_vec(), weights }
    }

    /// The constant's, then the factors'.
    pub(crate) fn weights(&self) -> &[f64] {
        self.weights.as_slice()
    }

    fn light(&self, row: &Row) -> f64 {
        regressors(row, &self.which).dot(&self.weights)
    }

    /// On the other suns: root mean square error over the mean of the truth, and the largest relative
    /// error of a sun's mean.
    pub(crate) fn errors(&self, samples: &Samples) -> [f64; 2] {
        let (mut square, mut sum, mut count, mut worst) = (0.0, 0.0, 0.0, 0.0f64);
        for rows in samples.rows.iter().skip(1).step_by(2) {
            let (mut own, mut truth) = (0.0, 0.0);
            for row in rows {
                let light = self.light(row);
                let t = row[FACTORS.len()];
                square += (light - t).powi(2);
                (own, truth) = (own + light, truth + t);
            }
            sum += truth;
            count += rows.len() as f64;
            let off = own / truth - 1.0;
            if off.abs() > worst.abs() {
                worst = off;
            }
        }
        [(square / count).sqrt() / (sum / count), worst]
    }
}

fn regressors(row: &Row, which: &[usize]) -> DVector<f64> {
    let sum = which.iter().filter(|i| **i != PRODUCT);
    let scale = if which.contains(&PRODUCT) { row[FACTORS.len() - 1] } else { 1.0 };
    let all: Vec<f64> =
        std::iter::once(1.0).chain(sum.map(|i| row[*i])).map(|x| x * scale).collect();
    DVector::from_vec(all)
}
