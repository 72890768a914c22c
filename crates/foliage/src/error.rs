//! What can go wrong in a bake of foliage.

use forest_pack::PackError;
use forest_soup::InvalidSoup;

/// Why a bake of foliage failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FoliageError {
    /// An option makes no sense.
    #[error("foliage: {0}")]
    Options(String),
    /// The source breaks its own rules.
    #[error(transparent)]
    Soup(#[from] InvalidSoup),
    /// A pattern that was given fits no material.
    #[error("no material is called {pattern:?}; there are {}", .materials.join(", "))]
    NoSuchMaterial {
        /// As it was given.
        pattern: String,
        /// Names of all materials.
        materials: Vec<String>,
    },
    /// Nothing looks like leaves.
    #[error("no leaves found in {triangles} triangles of {}; say which material they are by --leaf", .materials.join(", "))]
    NoLeaves {
        /// Triangles that were looked at.
        triangles: usize,
        /// Names of all materials.
        materials: Vec<String>,
    },
    /// The source has no triangle with finite corners, or no extent.
    #[error("nothing to see: no triangle with finite corners and an extent")]
    NothingToSee,
    /// More branches bend than vertices can name.
    #[error(
        "{branches} branches bend in the wind; vertices tell {limit} apart: bake fewer trees in one block"
    )]
    TooManyBranches {
        /// Branches that move.
        branches: usize,
        /// The limit.
        limit: usize,
    },
    /// The cards do not fit into the largest atlas.
    #[error(
        "the cards take {texels} texels, more than the {limit} of the largest atlas; give a larger --texel"
    )]
    AtlasFull {
        /// Texels of all cards.
        texels: u64,
        /// Texels of the largest atlas.
        limit: u64,
    },
    /// The pack could not be written.
    #[error(transparent)]
    Pack(#[from] PackError),
}
