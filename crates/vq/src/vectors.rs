//! Vectors to be coded.

use crate::error::VqError;

/// Values lie within ± this: squared distances stay far from the end of f32.
pub const MAX_VALUE: f32 = 1e15;

/// Vectors of one dimension, one after the other. Squared distances are f32: those below 1e-38, of
/// elements that differ by less than 1e-19, may count as 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Vectors {
    dimension: usize,
    values: Vec<f32>,
}

impl Vectors {
    /// `values` holds the vectors one after the other, `dimension` numbers each, in any unit; none
    /// at all is allowed.
    ///
    /// # Errors
    /// [`VqError::NoDimension`]; [`VqError::Ragged`] if the last vector is cut off;
    /// [`VqError::TooMany`] above `u32::MAX` vectors; [`VqError::Value`] for the first value that is
    /// not finite or beyond ±[`MAX_VALUE`].
    pub fn new(dimension: usize, values: Vec<f32>) -> Result<Self, VqError> {
        if dimension == 0 {
            return Err(VqError::NoDimension);
        }
        if !values.len().is_multiple_of(dimension) {
            return Err(VqError::Ragged { length: values.len(), dimension });
        }
        let rows = values.len() / dimension;
        if u32::try_from(rows).is_err() {
            return Err(VqError::TooMany(rows));
        }
        if let Some(i) = values.iter().position(|v| v.is_nan() || v.abs() > MAX_VALUE) {
            let (row, element) = (i / dimension, i % dimension);
            return Err(VqError::Value { row, element, value: values[i] });
        }
        Ok(Self { dimension, values })
    }

    /// Numbers in a vector, ≥ 1.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Vectors.
    pub fn len(&self) -> usize {
        self.values.len() / self.dimension
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Vector `i`: `dimension` numbers.
    ///
    /// # Panics
    /// If there is no such vector.
    pub fn row(&self, i: usize) -> &[f32] {
        &self.values[i * self.dimension..][..self.dimension]
    }

    /// All of them, one after the other.
    pub fn values(&self) -> &[f32] {
        &self.values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bad_vectors_are_refused_with_the_place() {
        assert_eq!(Vectors::new(0, vec![]), Err(VqError::NoDimension));
        let ragged = VqError::Ragged { length: 5, dimension: 2 };
        assert_eq!(Vectors::new(2, vec![0.0; 5]), Err(ragged));
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1.1e15] {
            let error = Vectors::new(2, vec![0.0, 1.0, 2.0, bad]).unwrap_err();
            assert!(matches!(error, VqError::Value { row: 1, element: 1, .. }), "{error}");
        }
        let message = Vectors::new(1, vec![-2e15]).unwrap_err().to_string();
        assert_eq!(message, "row 0, element 0: -2000000000000000; finite values within ±1e15");
    }

    #[test]
    fn rows_are_found() {
        let v = Vectors::new(2, vec![1.0, 2.0, 3.0, 4.0]).unwrap();
        assert_eq!(
            (v.dimension(), v.len(), v.is_empty(), v.row(1)),
            (2, 2, false, &[3.0, 4.0][..])
        );
        assert!(Vectors::new(3, vec![]).unwrap().is_empty());
    }
}
