//! What can go wrong.

use forest_pack::PackError;
use forest_points::BakeError;
use forest_soup::InvalidSoup;

/// Why an evaluation could not be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EvalError {
    /// The source breaks its own rules.
    #[error(transparent)]
    Soup(#[from] InvalidSoup),
    /// A pack could not be read or written.
    #[error(transparent)]
    Pack(#[from] PackError),
    /// A baseline could not be baked.
    #[error(transparent)]
    Bake(#[from] BakeError),
    /// The source shows nothing.
    #[error("the source has no triangle with an extent: there is nothing to compare with")]
    NothingToSee,
    /// The source covers nothing in some view: it is transparent, or far smaller than its box.
    #[error(
        "the source covers nothing from {elevation:.0}° above the horizon: no coverage to keep"
    )]
    Unseen {
        /// Of the view, in degrees.
        elevation: f64,
    },
    /// The temporary folder is not there or full.
    #[error("cannot use the temporary folder")]
    Temporary(#[source] std::io::Error),
    /// A plan that makes no sense.
    #[error("{option} is {value}; it must be {rule}")]
    Plan {
        /// Its name on the command line.
        option: &'static str,
        /// What it was set to.
        value: String,
        /// What it may be.
        rule: &'static str,
    },
    /// A photograph's camera cannot be drawn from.
    #[error(
        "{0} cannot judge: its matte is empty, or its lens, pixels or centre are not a plain camera's"
    )]
    Lens(String),
    /// The report could not be made.
    #[error("cannot make the report: {0}")]
    Report(String),
}
