//! Reading files: bounded, hashed, and within the asset's folder.

use crate::ImportError;
use crate::files::{Content, Files};
use base64::Engine;
use std::borrow::Cow;
use std::cell::Cell;
use std::io;
use std::path::{Component, Path, PathBuf};

/// What a source may claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Largest file, in bytes.
    pub file_bytes: u64,
    /// Longest side of a texture, in texels.
    pub texture_side: u32,
    /// Bytes that all files of a tree, and what is decoded of them, may have together: small files can name
    /// the same data many times.
    pub total_bytes: u64,
    /// Files outside the folder of the file that names them may be read.
    pub allow_outside: bool,
}

impl Default for Limits {
    /// 8 GiB a file, 16384 texels a side, 32 GiB in all, nothing outside.
    fn default() -> Self {
        Self {
            file_bytes: 8 << 30,
            texture_side: 16_384,
            total_bytes: 32 << 30,
            allow_outside: false,
        }
    }
}

/// The name of standard input, as a file.
pub(crate) const STDIN: &str = "-";

/// A file being imported, with what it refers to.
pub(crate) struct Source<'a> {
    pub(crate) path: PathBuf,
    pub(crate) limits: Limits,
    files: &'a Files,
    content: Option<Content>,
    hasher: blake3::Hasher,
    warnings: Vec<String>,
    /// Bytes read and decoded so far.
    used: Cell<u64>,
}

impl<'a> Source<'a> {
    pub(crate) fn open(files: &'a Files, path: &Path, limits: Limits) -> Result<Self, ImportError> {
        let mut source = Self {
            path: path.into(),
            limits,
            files,
            content: None,
            hasher: blake3::Hasher::new(),
            warnings: Vec::new(),
            used: Cell::new(0),
        };
        source.content = Some(source.read(path)?);
        Ok(source)
    }

    /// What the file is, by its name; of standard input, by how it begins.
    pub(crate) fn extension(&self) -> Result<Option<String>, ImportError> {
        if self.path != Path::new(STDIN) {
            let extension = self.path.extension();
            return Ok(extension.map(|e| e.to_string_lossy().to_ascii_lowercase()));
        }
        let most = self.content.as_ref().map_or(0, |c| c.len().min(64));
        let begin = self.content.as_ref().map(|c| c.range(0..most)).transpose();
        let begin = begin.map_err(|e| self.io(e))?.flatten().unwrap_or_default();
        let is_json = begin.trim_ascii_start().starts_with(b"{");
        Ok(Some(if begin.starts_with(b"glTF") || is_json { "glb" } else { "obj" }.into()))
    }

    /// The file itself; it can be had once.
    pub(crate) fn content(&mut self) -> Content {
        self.content.take().unwrap_or(Content::Memory(Vec::new()))
    }

    /// The bytes of the file itself; they can be had once.
    pub(crate) fn bytes(&mut self) -> Result<Vec<u8>, ImportError> {
        self.content().whole().map_err(|source| self.io(source))
    }

    pub(crate) fn warn(&mut self, what: String) {
        self.warnings.push(format!("{}: {what}", self.path.display()));
    }

    pub(crate) fn io(&self, source: io::Error) -> ImportError {
        ImportError::Io { file: self.path.clone(), source }
    }

    pub(crate) fn invalid(&self, element: impl ToString, problem: impl ToString) -> ImportError {
        ImportError::invalid(&self.path, element, problem)
    }

    pub(crate) fn unsupported(&self, what: impl ToString) -> ImportError {
        ImportError::unsupported(&self.path, what)
    }

    /// Counts bytes that are about to be read or decoded.
    ///
    /// # Errors
    /// When the limit for all of them is passed.
    pub(crate) fn charge(&self, element: &str, bytes: u64) -> Result<(), ImportError> {
        let used = self.used.get().saturating_add(bytes);
        if used > self.limits.total_bytes {
            let most = self.limits.total_bytes;
            let problem =
                format!("{used} bytes to read and decode up to here; the limit is {most}");
            return Err(self.invalid(element, problem));
        }
        self.used.set(used);
        Ok(())
    }

    /// Bytes that may still be read and decoded.
    pub(crate) fn left(&self) -> u64 {
        self.limits.total_bytes - self.used.get()
    }

    /// The content behind a URI: a data URI, or a file (percent-encoded, relative to this one).
    pub(crate) fn uri(&mut self, element: &str, uri: &str) -> Result<Content, ImportError> {
        if let Some(data) = uri.strip_prefix("data:") {
            let Some((kind, payload)) = data.split_once(',') else {
                return Err(self.invalid(element, "data URI without a comma"));
            };
            if !kind.ends_with(";base64") {
                return Err(self.unsupported(format!("{element}: a data URI of kind {kind:?}")));
            }
            self.charge(element, payload.len() as u64)?;
            return base64::engine::general_purpose::STANDARD
                .decode(payload.trim_end())
                .map(Content::Memory)
                .map_err(|e| self.invalid(element, format!("base64: {e}")));
        }
        let name = percent_encoding::percent_decode_str(uri)
            .decode_utf8()
            .map_err(|e| self.invalid(element, format!("URI {uri:?}: {e}")))?;
        self.content_of(element, &name)
    }

    /// The bytes of a file named relative to this one.
    pub(crate) fn file(&mut self, element: &str, name: &str) -> Result<Vec<u8>, ImportError> {
        self.content_of(element, name)?.whole().map_err(|source| self.io(source))
    }

    fn content_of(&mut self, element: &str, name: &str) -> Result<Content, ImportError> {
        let name = plain(name);
        let relative = Path::new(&*name);
        let inside =
            relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
        if !inside && !self.limits.allow_outside {
            let problem = format!("{name:?} is outside the file's folder (see --allow-outside)");
            return Err(self.invalid(element, problem));
        }
        let path = resolved(&self.path, &name);
        self.read(&path).map_err(|e| match e {
            ImportError::Io { source, .. } => {
                self.invalid(element, format!("cannot read {}: {source}", path.display()))
            }
            other => other,
        })
    }

    fn read(&mut self, path: &Path) -> Result<Content, ImportError> {
        let io = |source| ImportError::Io { file: path.into(), source };
        let most = self.limits.file_bytes;
        let content = self.files.open(path, most).map_err(io)?.ok_or_else(|| {
            ImportError::invalid(path, "file", format!("more than {most} bytes, the limit"))
        })?;
        self.charge("file", content.len())?;
        self.hasher.update(content.hash().map_err(io)?.as_bytes());
        Ok(content)
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
