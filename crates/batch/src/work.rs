//! Folders in which something is made before it takes its name: locked while somebody works there, and removed
//! by the next if nobody does any more.

use std::fs::{File, TryLockError};
use std::io;
use std::path::Path;
use std::time::Duration;
use tempfile::TempDir;

/// In a folder of work, open and locked as long as somebody works in it.
const LOCK: &str = ".lock";

/// A folder without a lock is new, about to take its name, or left over from somebody who was killed while
/// removing it: the last once it is as old as this.
const LEFT: Duration = Duration::from_secs(10);

/// A folder of work; it goes away with this.
#[derive(Debug)]
pub struct WorkFolder {
    folder: TempDir,
    /// Locked as long as it is open.
    _lock: File,
}

impl WorkFolder {
    /// A folder in `within`, whose name begins with `prefix`. What others left there that were killed is removed.
    ///
    /// # Errors
    /// When the folder cannot be read or written.
    pub fn new(within: &Path, prefix: &str) -> io::Result<Self> {
        Self::remove_left(within, prefix)?;
        loop {
            let folder = tempfile::Builder::new().prefix(prefix).tempdir_in(within)?;
            let path = folder.path().join(LOCK);
            let lock = File::create(&path)?;
            lock.lock()?;
            // Somebody may have met it before it was locked.
            if path.exists() {
                return Ok(Self { folder, _lock: lock });
            }
        }
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Removes folders that begin with `prefix` and that nobody holds any more.
    ///
    /// # Errors
    /// When `within` cannot be read.
    pub fn remove_left(within: &Path, prefix: &str) -> io::Result<()> {
        for entry in std::fs::read_dir(within)?.flatten() {
            if entry.file_name().to_string_lossy().starts_with(prefix) {
                // What cannot be removed now is tried again the next time.
                let _ = remove_if_left(&entry.path());
            }
        }
        Ok(())
    }

    /// Gives the folder, without its lock, another name.
    ///
    /// # Errors
    /// When it cannot: if the name is taken, say.
    pub(crate) fn rename(self, to: &Path) -> io::Result<()> {
        std::fs::remove_file(self.path().join(LOCK))?;
        std::fs::rename(self.path(), to)?;
        // It has moved.
        let _ = self.folder.keep();
        Ok(())
    }
}

fn remove_if_left(folder: &Path) -> io::Result<()> {
    match File::open(folder.join(LOCK)) {
        Ok(lock) => match lock.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Ok(()),
            Err(TryLockError::Error(e)) => return Err(e),
        },
        Err(e) if e.kind() == io::ErrorKind::NotFound => {
            let age = std::fs::metadata(folder)?.modified()?.elapsed();
            if age.is_ok_and(|age| age < LEFT) {
                return Ok(());
            }
        }
        Err(e) => return Err(e),
    }
    std::fs::remove_dir_all(folder)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::SystemTime;

    fn age(folder: &Path) {
        let past = SystemTime::now() - Duration::from_secs(60);
        File::open(folder).unwrap().set_modified(past).unwrap();
    }

    #[test]
    fn what_the_dead_left_is_removed_even_if_its_removal_was_interrupted() {
        let dir = tempfile::tempdir().unwrap();
        let count = || std::fs::read_dir(dir.path()).unwrap().count();
        let held = WorkFolder::new(dir.path(), "w-").unwrap();
        let dead = WorkFolder::new(dir.path(), "w-").unwrap();
        let WorkFolder { folder, _lock } = dead;
        std::fs::write(folder.keep().join("half"), "x").unwrap();
        drop(_lock);
        assert_eq!(count(), 2);
        WorkFolder::remove_left(dir.path(), "other-").unwrap();
        assert_eq!(count(), 2);
        WorkFolder::remove_left(dir.path(), "w-").unwrap();
        assert_eq!(count(), 1);
        // Without a lock: one that is new might get one.
        let bare = dir.path().join("w-bare");
        std::fs::create_dir(&bare).unwrap();
        std::fs::write(bare.join("half"), "x").unwrap();
        WorkFolder::remove_left(dir.path(), "w-").unwrap();
        assert!(bare.exists());
        age(&bare);
        WorkFolder::remove_left(dir.path(), "w-").unwrap();
        assert!(!bare.exists() && held.path().exists());
    }
}
