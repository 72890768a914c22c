//! What goes wrong with a source file.

use std::path::{Path, PathBuf};

/// Why a tree could not be read. Every message names the file and the element.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// A file could not be read.
    #[error("{file}: cannot read: {source}", file = file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// The file breaks its format's rules.
    #[error("{file}: {element}: {problem}", file = file.display())]
    Invalid {
        /// The file.
        file: PathBuf,
        /// Which part of it.
        element: String,
        /// Which rule, with value and limit.
        problem: String,
    },
    /// The file needs something that this version does not read.
    #[error("{file}: needs {what}, which is not supported", file = file.display())]
    Unsupported {
        /// The file.
        file: PathBuf,
        /// The extension, format or feature.
        what: String,
    },
}

impl ImportError {
    /// The code that programs exit with: 2 for input and output, 5 for what is not supported, 3 for
    /// what is invalid.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Io { .. } => 2,
            Self::Unsupported { .. } => 5,
            _ => 3,
        }
    }

    pub(crate) fn invalid(file: &Path, element: impl ToString, problem: impl ToString) -> Self {
        Self::Invalid {
            file: file.into(),
            element: element.to_string(),
            problem: problem.to_string(),
        }
    }

    pub(crate) fn unsupported(file: &Path, what: impl ToString) -> Self {
        Self::Unsupported { file: file.into(), what: what.to_string() }
    }
}
