//! What does not fit in memory while something is made.

use crate::PackError;
use memmap2::{Mmap, MmapOptions};
use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::marker::PhantomData;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A nameless file in the folder of what is made: written at any place, then mapped in parts. It is gone with the
/// program, however that ends.
pub struct Scratch {
    file: File,
    target: PathBuf,
}

/// Mapped bytes of a [`Scratch`].
pub struct ScratchPart<'a> {
    map: Option<Mmap>,
    /// No writing while it is mapped.
    _of: PhantomData<&'a Scratch>,
}

impl Scratch {
    /// An empty file where `target` will be.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn beside(target: &Path) -> Result<Self, PackError> {
        let file = tempfile::tempfile_in(folder(target))
            .map_err(PackError::io(target, "cannot create a file beside it"))?;
        Ok(Self { file, target: target.into() })
    }

    /// Writes `bytes` from byte `at` on.
    ///
    /// # Errors
    /// When the disk is full.
    pub fn write(&mut self, at: u64, bytes: &[u8]) -> Result<(), PackError> {
        let failed = PackError::io(&self.target, "cannot write a temporary file beside it");
        self.file.seek(SeekFrom::Start(at)).and_then(|_| self.file.write_all(bytes)).map_err(failed)
    }

    /// Maps bytes that were written; nothing is written while they are mapped (parts borrow the file).
    ///
    /// # Errors
    /// When memory cannot be mapped.
    pub fn map(&self, range: Range<u64>) -> Result<ScratchPart<'_>, PackError> {
        if range.is_empty() {
            return Ok(ScratchPart { map: None, _of: PhantomData });
        }
        let mut options = MmapOptions::new();
        options.offset(range.start).len((range.end - range.start) as usize);
        // SAFETY: the file has no name, so that nobody else writes or shortens it; parts borrow it, so
        // that `write` waits for them.
        #[expect(unsafe_code, reason = "memory maps have no safe constructor")]
        let map = unsafe { options.map(&self.file) };
        let failed = PackError::io(&self.target, "cannot map a temporary file beside it");
        Ok(ScratchPart { map: Some(map.map_err(failed)?), _of: PhantomData })
    }
}

impl ScratchPart<'_> {
    /// The bytes.
    pub fn bytes(&self) -> &[u8] {
        self.map.as_deref().unwrap_or(&[])
    }
}

/// The folder of a file.
pub(crate) fn folder(target: &Path) -> &Path {
    target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_what_was_written_and_no_file_is_seen() {
        let dir = tempfile::tempdir().unwrap();
        let mut scratch = Scratch::beside(&dir.path().join("a.fpack")).unwrap();
        scratch.write(5000, b"second").unwrap();
        scratch.write(0, &[7; 5000]).unwrap();
        assert_eq!(scratch.map(4998..5006).unwrap().bytes(), b"\x07\x07second");
        assert_eq!(scratch.map(5000..5000).unwrap().bytes(), b"");
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
        assert!(Scratch::beside(&dir.path().join("none/a.fpack")).is_err());
    }
}
