//! What can go wrong with scenes.

use forest_pack::PackError;
use std::path::{Path, PathBuf};

/// What went wrong with a scene. Every message names the file and the element.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
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
    /// A file breaks a rule.
    #[error("{file}: {element}: {problem}", file = file.display())]
    Invalid {
        /// The file.
        file: PathBuf,
        /// The key, the record or the picture.
        element: String,
        /// Which rule, with the value and the limit.
        problem: String,
    },
    /// A pack of a species.
    #[error(transparent)]
    Pack(#[from] PackError),
}

impl SceneError {
    /// The code that programs exit with: 2 for input and output, 3 for what is invalid, a pack's own.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Io { .. } => 2,
            Self::Invalid { .. } => 3,
            Self::Pack(e) => e.exit_code(),
        }
    }

    pub(crate) fn invalid(file: &Path, element: impl ToString, problem: impl ToString) -> Self {
        Self::Invalid {
            file: file.into(),
            element: element.to_string(),
            problem: problem.to_string(),
        }
    }

    pub(crate) fn io(file: &Path, action: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        let file = file.into();
        move |source| Self::Io { file, action, source }
    }
}
