//! What can go wrong in a bake of a volume.

use forest_pack::PackError;
use forest_soup::InvalidSoup;
use forest_vq::VqError;

/// Why a bake of a volume failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VolumeError {
    /// An option makes no sense.
    #[error("volume: {0}")]
    Options(String),
    /// The source breaks its own rules.
    #[error(transparent)]
    Soup(#[from] InvalidSoup),
    /// The source has no triangle with finite corners and an extent, or no matte shows anything.
    #[error("nothing to see: {0}")]
    NothingToSee(String),
    /// The photographs contradict each other.
    #[error("the photographs contradict each other: {0}")]
    Inconsistent(String),
    /// No codebook is good enough.
    #[error("no codebook reaches {wanted} dB: {words} codewords reach {reached:.2}")]
    Quality {
        /// What was asked for.
        wanted: f64,
        /// Codewords of the largest codebook.
        words: usize,
        /// What it reaches.
        reached: f64,
    },
    /// Codebooks could not be trained.
    #[error(transparent)]
    Codebook(#[from] VqError),
    /// The pack could not be written.
    #[error(transparent)]
    Pack(#[from] PackError),
}
