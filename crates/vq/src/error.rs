//! What can go wrong.

/// Why vectors, a codebook or options are refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum VqError {
    /// Vectors without numbers.
    #[error("vectors of dimension 0; at least 1")]
    NoDimension,
    /// The values are no whole number of vectors.
    #[error("{length} values are no whole number of vectors of dimension {dimension}")]
    Ragged {
        /// Values given.
        length: usize,
        /// Values of a vector.
        dimension: usize,
    },
    /// More vectors than 32-bit numbers.
    #[error("{0} vectors; the limit is {limit}", limit = u32::MAX)]
    TooMany(usize),
    /// A value is not finite, or so large that squared distances would not be.
    #[error(
        "row {row}, element {element}: {value}; finite values within ±{limit:e}",
        limit = crate::MAX_VALUE
    )]
    Value {
        /// The vector.
        row: usize,
        /// Of its values.
        element: usize,
        /// What it is.
        value: f32,
    },
    /// No vectors to train with.
    #[error("no vectors")]
    Empty,
    /// Not one weight a vector.
    #[error("{got} weights for {expected} vectors")]
    WeightCount {
        /// Vectors.
        expected: usize,
        /// Weights.
        got: usize,
    },
    /// A weight is negative, or no number.
    #[error("weight {row} is {value}; finite numbers from 0")]
    Weight {
        /// The vector it belongs to.
        row: usize,
        /// What it is.
        value: f32,
    },
    /// Nothing weighs anything.
    #[error("all {0} weights are 0")]
    NoWeight(usize),
    /// An option makes no sense.
    #[error("{name} is {value}; {limit}")]
    Option {
        /// Which.
        name: &'static str,
        /// What it is.
        value: f64,
        /// What it may be.
        limit: &'static str,
    },
}
