//! What can go wrong in a bake of views.

use forest_pack::PackError;
use forest_soup::InvalidSoup;

/// Why a bake of views failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ViewsError {
    /// An option makes no sense.
    #[error("views: {0}")]
    Options(String),
    /// The source breaks its own rules.
    #[error(transparent)]
    Soup(#[from] InvalidSoup),
    /// The source has no triangle with finite corners, or no extent.
    #[error("nothing to see: no triangle with finite corners and an extent")]
    NothingToSee,
    /// The pack could not be written.
    #[error(transparent)]
    Pack(#[from] PackError),
}
