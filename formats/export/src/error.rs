//! What can go wrong in an export.

use forest_pack::PackError;

/// Why an export failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// The pack is damaged.
    #[error(transparent)]
    Pack(#[from] PackError),
    /// A picture could not be encoded.
    #[error("cannot encode a picture: {0}")]
    Image(#[from] image::ImageError),
    /// An EXR file could not be encoded.
    #[error("cannot encode an EXR file: {0}")]
    Exr(#[from] exr::error::Error),
    /// The views do not have what the target reads.
    #[error("{0}")]
    Unsuited(String),
}
