//! Three classes of failure: the file could not be read or written, it breaks a rule, or it needs
//! something this version does not know.

use std::path::{Path, PathBuf};

/// What went wrong with a pack. Every message names the file and the element.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PackError {
    /// Reading or writing failed.
    #[error("{file}: {action}: {source}", file = file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// What was being done.
        action: &'static str,
        /// The cause.
        source: std::io::Error,
    },
    /// The pack breaks a rule of SPEC.md.
    #[error("{file}: {element}: {problem}", file = file.display())]
    Invalid {
        /// The file.
        file: PathBuf,
        /// The header, the table entry or the section.
        element: String,
        /// Which rule, with the value and the limit.
        problem: String,
    },
    /// A version or codec that this build does not know.
    #[error("{file}: {element}: {problem}", file = file.display())]
    Unsupported {
        /// The file.
        file: PathBuf,
        /// The header, the table entry or the section.
        element: String,
        /// What is not supported.
        problem: String,
    },
}

impl PackError {
    /// The code that programs exit with: 2 for input and output, 5 for what is not supported, 3 for
    /// what is invalid.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Io { .. } => 2,
            Self::Unsupported { .. } => 5,
            _ => 3,
        }
    }

    /// An [`PackError::Invalid`], for owners of sections.
    pub fn invalid(file: &Path, element: impl ToString, problem: impl ToString) -> Self {
        Self::Invalid {
            file: file.into(),
            element: element.to_string(),
            problem: problem.to_string(),
        }
    }

    pub(crate) fn unsupported(file: &Path, element: impl ToString, problem: String) -> Self {
        Self::Unsupported { file: file.into(), element: element.to_string(), problem }
    }

    pub(crate) fn io(file: &Path, action: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        let file = file.into();
        move |source| Self::Io { file, action, source }
    }
}
