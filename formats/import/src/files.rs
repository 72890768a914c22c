//! Where the bytes of files come from, and what of them is held in memory.

use crate::ImportError;
use crate::source::STDIN;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Where files are read from.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Files {
    /// The file system.
    #[default]
    Disk,
    /// Memory: what came through a pipe or a network. Other files are not there.
    Memory(BTreeMap<PathBuf, Vec<u8>>),
}

/// The content of one file.
pub(crate) enum Content {
    Memory(Vec<u8>),
    /// A large file stays where it is: its parts are read when they are needed.
    Disk(File, u64),
}

/// Files from this length on are not read as a whole before their parts are known.
const LARGE: u64 = 64 << 20;

impl Files {
    /// What comes through standard input, at most `most` bytes, as the file `-`.
    ///
    /// # Errors
    /// When it cannot be read or is longer.
    pub fn stdin(most: u64) -> Result<Self, ImportError> {
        let name = PathBuf::from(STDIN);
        let mut bytes = Vec::new();
        io::stdin()
            .take(most.saturating_add(1))
            .read_to_end(&mut bytes)
            .map_err(|source| ImportError::Io { file: name.clone(), source })?;
        // One that is too long is told where it is opened.
        Ok(Self::Memory([(name, bytes)].into()))
    }

    /// Opens a file of at most `most` bytes; `None` if it has more.
    pub(crate) fn open(&self, path: &Path, most: u64) -> io::Result<Option<Content>> {
        let content = match self {
            Self::Memory(files) => {
                let bytes = files.get(path).ok_or(io::ErrorKind::NotFound)?;
                Content::Memory(bytes.clone())
            }
            Self::Disk => {
                let file = File::open(path)?;
                // What is no regular file, a pipe say, has no length.
                let length = Some(file.metadata()?).filter(|m| m.is_file()).map_or(0, |m| m.len());
                if length >= LARGE {
                    Content::Disk(file, length)
                } else {
                    let mut bytes = Vec::new();
                    file.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
                    Content::Memory(bytes)
                }
            }
        };
        Ok(Some(content).filter(|c| c.len() <= most))
    }
}

impl Content {
    pub(crate) fn len(&self) -> u64 {
        match self {
            Self::Memory(bytes) => bytes.len() as u64,
            Self::Disk(_, length) => *length,
        }
    }

    /// BLAKE3 of all bytes.
    pub(crate) fn hash(&self) -> io::Result<blake3::Hash> {
        match self {
            Self::Memory(bytes) => Ok(blake3::hash(bytes)),
            Self::Disk(file, _) => {
                let mut file = file;
                file.seek(SeekFrom::Start(0))?;
                Ok(blake3::Hasher::new().update_reader(file)?.finalize())
            }
        }
    }

    /// Some of its bytes, `None` if it has not that many.
    pub(crate) fn range(&self, range: Range<u64>) -> io::Result<Option<Cow<'_, [u8]>>> {
        if range.start > range.end || range.end > self.len() {
            return Ok(None);
        }
        match self {
            Self::Memory(bytes) => {
                Ok(Some(Cow::Borrowed(&bytes[range.start as usize..range.end as usize])))
            }
            Self::Disk(file, _) => {
                let mut bytes = Vec::with_capacity((range.end - range.start) as usize);
                let mut file = file;
                file.seek(SeekFrom::Start(range.start))?;
                file.take(range.end - range.start).read_to_end(&mut bytes)?;
                let whole = bytes.len() as u64 == range.end - range.start;
                Ok(Some(Cow::Owned(bytes)).filter(|_| whole))
            }
        }
    }

    /// All of its bytes.
    pub(crate) fn whole(self) -> io::Result<Vec<u8>> {
        match self {
            Self::Memory(bytes) => Ok(bytes),
            Self::Disk(mut file, length) => {
                let mut bytes = Vec::with_capacity(length as usize);
                file.seek(SeekFrom::Start(0))?;
                file.take(length).read_to_end(&mut bytes)?;
                Ok(bytes)
            }
        }
    }
}
