//! Finished bakes by what they were made of, in a folder that several machines may share.
//!
//! An entry is a folder that takes its name only when it is whole, by one rename: of two writers of one entry the
//! first wins, and what the second made is the same.

use crate::error::BatchError;
use crate::event::Done;
use crate::work::WorkFolder;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The cache.
#[derive(Clone, Debug)]
pub struct Cache {
    folder: PathBuf,
}

/// What is told of an entry; its paths are relative to it.
#[derive(Debug, Serialize, Deserialize)]
struct Told {
    done: Done,
}

/// Name of the file in an entry that tells of it.
const TOLD: &str = "done.json";

/// How folders are named in which entries are made.
const MAKING: &str = "entry-";

impl Cache {
    /// The cache in a folder, which is made if need be. What runs left there that were killed is removed.
    ///
    /// # Errors
    /// When the folder cannot be made or read.
    pub fn open(folder: &Path) -> Result<Self, BatchError> {
        let new = Self { folder: folder.into() };
        let making = new.making();
        std::fs::create_dir_all(&making).map_err(BatchError::io(&making))?;
        WorkFolder::remove_left(&making, MAKING).map_err(BatchError::io(&making))?;
        Ok(new)
    }

    fn making(&self) -> PathBuf {
        self.folder.join("making")
    }

    fn entry(&self, key: &str) -> PathBuf {
        self.folder.join(&key[..2]).join(key)
    }

    /// A folder to make an entry in.
    pub(crate) fn make(&self) -> Result<WorkFolder, BatchError> {
        let making = self.making();
        WorkFolder::new(&making, MAKING).map_err(BatchError::io(&making))
    }

    /// Gives what was made its name; paths of `done` lie in the folder.
    pub(crate) fn publish(
        &self,
        key: &str,
        making: WorkFolder,
        done: &Done,
    ) -> Result<(), BatchError> {
        let from = making.path();
        let inner = |p: &PathBuf| p.strip_prefix(from).unwrap_or(p).to_path_buf();
        let output = inner(&done.output);
        let exports = done.exports.iter().map(inner).collect();
        let told = Told { done: Done { output, exports, ..done.clone() } };
        let path = from.join(TOLD);
        let text = serde_json::to_vec_pretty(&told).expect("names and numbers");
        std::fs::write(&path, text).map_err(BatchError::io(&path))?;
        let to = self.entry(key);
        let shelf = to.parent().unwrap_or(&self.folder);
        std::fs::create_dir_all(shelf).map_err(BatchError::io(shelf))?;
        match making.rename(&to) {
            Ok(()) => Ok(()),
            // Another writer was first.
            Err(_) if to.join(TOLD).is_file() => Ok(()),
            Err(e) => Err(BatchError::io(&to)(e)),
        }
    }

    /// What is told of an entry, with whole paths; none if it is not there.
    pub(crate) fn find(&self, key: &str) -> Option<Done> {
        let entry = self.entry(key);
        let told: Told = serde_json::from_slice(&std::fs::read(entry.join(TOLD)).ok()?).ok()?;
        let whole = |p: &PathBuf| entry.join(p);
        let done = told.done;
        let exports: Vec<PathBuf> = done.exports.iter().map(whole).collect();
        let done = Done { output: whole(&done.output), exports, ..done };
        let all_there = done.output.is_file() && done.exports.iter().all(|e| e.is_file());
        all_there.then_some(done)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made(cache: &Cache, bytes: &[u8]) -> (WorkFolder, Done) {
        let making = cache.make().unwrap();
        let output = making.path().join("t.fpack");
        std::fs::write(&output, bytes).unwrap();
        (making, Done { output, bytes: bytes.len() as u64, ..Done::default() })
    }

    #[test]
    fn the_first_of_two_writers_wins() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::open(folder.path()).unwrap();
        let key = "abcdef";
        assert_eq!(cache.find(key), None);
        let (first, first_done) = made(&cache, b"one");
        let (second, second_done) = made(&cache, b"one");
        // Another run that begins meanwhile takes neither away.
        Cache::open(folder.path()).unwrap();
        cache.publish(key, first, &first_done).unwrap();
        cache.publish(key, second, &second_done).unwrap();
        let done = cache.find(key).unwrap();
        assert_eq!((std::fs::read(&done.output).unwrap(), done.bytes), (b"one".to_vec(), 3));
        let making = std::fs::read_dir(cache.making()).unwrap();
        assert_eq!(making.count(), 0, "nothing is left behind");
    }
}
