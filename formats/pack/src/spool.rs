//! A section that is still being written, while others are too.

use crate::layout::{ENTRY_HASH, short};
use crate::scratch::folder;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;
use tempfile::SpooledTempFile;

/// Bytes kept in memory before a spool moves to a temporary file.
const IN_MEMORY: usize = 64 << 20;

/// Collects a section of unknown length: in memory up to 64 MiB, in a temporary file beyond.
/// Lets a bake write several sections cell by cell.
pub struct Spool {
    file: SpooledTempFile,
    hasher: blake3::Hasher,
    length: u64,
}

impl Spool {
    /// An empty section of the pack that will be `target`: what does not fit in memory lies in its folder.
    pub fn beside(target: &Path) -> Self {
        let file = SpooledTempFile::new_in(IN_MEMORY, folder(target));
        Self { file, hasher: blake3::Hasher::new(), length: 0 }
    }

    /// Bytes so far.
    pub fn len(&self) -> u64 {
        self.length
    }

    /// Whether nothing was written yet.
    pub fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// Hash of what was written.
    pub(crate) fn hash(&self) -> [u8; ENTRY_HASH] {
        short(self.hasher.finalize())
    }

    /// Copies everything to `out`.
    pub(crate) fn copy_to(&mut self, out: &mut impl Write) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(0))?;
        let copied = io::copy(&mut (&mut self.file).take(self.length), out)?;
        if copied == self.length { Ok(()) } else { Err(io::ErrorKind::UnexpectedEof.into()) }
    }
}

impl Write for Spool {
    fn write(&mut self, data: &[u8]) -> io::Result<usize> {
        let n = self.file.write(data)?;
        self.hasher.update(&data[..n]);
        self.length += n as u64;
        Ok(n)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}
