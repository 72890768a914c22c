//! Reading files: bounded, hashed, and within the asset's folder.

use crate::ImportError;
use base64::Engine;
use std::borrow::Cow;
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

/// What a source may claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Largest file, in bytes.
    pub file_bytes: u64,
    /// Longest side of a texture, in texels.
    pub texture_side: u32,
    /// Files outside the folder of the file that names them may be read.
    pub allow_outside: bool,
}

impl Default for Limits {
    /// 8 GiB a file, 16384 texels a side, nothing outside.
    fn default() -> Self {
        Self { file_bytes: 8 << 30, texture_side: 16_384, allow_outside: false }
    }
}

/// A file being imported, with what it refers to.
pub(crate) struct Source {
    pub(crate) path: PathBuf,
    pub(crate) bytes: Vec<u8>,
    pub(crate) limits: Limits,
    hasher: blake3::Hasher,
    warnings: Vec<String>,
}

impl Source {
    pub(crate) fn open(path: &Path, limits: Limits) -> Result<Self, ImportError> {
        let bytes = read(path, limits)?;
        let mut hasher = blake3::Hasher::new();
        hasher.update(blake3::hash(&bytes).as_bytes());
        Ok(Self { path: path.into(), bytes, limits, hasher, warnings: Vec::new() })
    }

    pub(crate) fn warn(&mut self, what: String) {
        self.warnings.push(format!("{}: {what}", self.path.display()));
    }

    pub(crate) fn invalid(&self, element: impl ToString, problem: impl ToString) -> ImportError {
        ImportError::invalid(&self.path, element, problem)
    }

    pub(crate) fn unsupported(&self, what: impl ToString) -> ImportError {
        ImportError::unsupported(&self.path, what)
    }

    /// The bytes of a URI: a data URI, or a file (percent-encoded, relative to this one).
    pub(crate) fn uri(&mut self, element: &str, uri: &str) -> Result<Vec<u8>, ImportError> {
        if let Some(data) = uri.strip_prefix("data:") {
            let Some((kind, payload)) = data.split_once(',') else {
                return Err(self.invalid(element, "data URI without a comma"));
            };
            if !kind.ends_with(";base64") {
                return Err(self.unsupported(format!("{element}: a data URI of kind {kind:?}")));
            }
            return base64::engine::general_purpose::STANDARD
                .decode(payload.trim_end())
                .map_err(|e| self.invalid(element, format!("base64: {e}")));
        }
        let name = percent_encoding::percent_decode_str(uri)
            .decode_utf8()
            .map_err(|e| self.invalid(element, format!("URI {uri:?}: {e}")))?;
        self.file(element, &name)
    }

    /// The bytes of a file named relative to this one.
    pub(crate) fn file(&mut self, element: &str, name: &str) -> Result<Vec<u8>, ImportError> {
        let name = plain(name);
        let relative = Path::new(&*name);
        let inside =
            relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
        if !inside && !self.limits.allow_outside {
            let problem = format!("{name:?} is outside the file's folder (see --allow-outside)");
            return Err(self.invalid(element, problem));
        }
        let path = resolved(&self.path, &name);
        let bytes = read(&path, self.limits).map_err(|e| match e {
            ImportError::Io { source, .. } => {
                self.invalid(element, format!("cannot read {}: {source}", path.display()))
            }
            other => other,
        })?;
        self.hasher.update(blake3::hash(&bytes).as_bytes());
        Ok(bytes)
    }

    pub(crate) fn finish(self) -> ([u8; 32], Vec<String>) {
        (*self.hasher.finalize().as_bytes(), self.warnings)
    }
}

/// Names from Windows use backslashes.
fn plain(name: &str) -> Cow<'_, str> {
    if name.contains('\\') { name.replace('\\', "/").into() } else { name.into() }
}

/// The place of a file that another one names.
pub(crate) fn resolved(from: &Path, name: &str) -> PathBuf {
    from.parent().unwrap_or(Path::new("")).join(&*plain(name))
}

fn read(path: &Path, limits: Limits) -> Result<Vec<u8>, ImportError> {
    let io = |source| ImportError::Io { file: path.into(), source };
    let file = File::open(path).map_err(io)?;
    let mut bytes = Vec::new();
    let read = file.take(limits.file_bytes + 1).read_to_end(&mut bytes).map_err(io)?;
    if read as u64 > limits.file_bytes {
        let problem = format!("more than {} bytes, the limit", limits.file_bytes);
        return Err(ImportError::invalid(path, "file", problem));
    }
    Ok(bytes)
}
