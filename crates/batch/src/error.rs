//! What can be wrong with a batch before any of its jobs begins.

use forest_import::ImportError;
use std::path::{Path, PathBuf};

/// What is wrong with a batch as a whole. What fails of a single job is told by its [`crate::Outcome`].
#[derive(Debug, thiserror::Error)]
pub enum BatchError {
    /// A file or folder of the batch could not be read or written.
    #[error("{}: {source}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// The manifest, or a file of an earlier run, breaks a rule.
    #[error("{}: {element}: {problem}", file.display())]
    Invalid {
        /// The file.
        file: PathBuf,
        /// Which part of it.
        element: String,
        /// Which rule, with value and limit.
        problem: String,
    },
    /// A block of trees that makes no sense.
    #[error("asset {name:?}")]
    Sources {
        /// The asset.
        name: String,
        /// The cause.
        source: ImportError,
    },
}

impl BatchError {
    /// The code that programs exit with: 2 for input and output, 3 for what is invalid.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Io { .. } => 2,
            Self::Invalid { .. } => 3,
            Self::Sources { source, .. } => source.exit_code(),
        }
    }

    pub(crate) fn io(file: &Path) -> impl FnOnce(std::io::Error) -> Self + '_ {
        move |source| Self::Io { file: file.into(), source }
    }

    pub(crate) fn invalid(file: &Path, element: impl ToString, problem: impl ToString) -> Self {
        Self::Invalid {
            file: file.into(),
            element: element.to_string(),
            problem: problem.to_string(),
        }
    }
}
