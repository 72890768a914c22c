//! Files that appear whole or not at all.

use crate::scratch::folder;
use std::fs::{DirEntry, File};
use std::io::{Result, Write};
use std::path::Path;
use std::time::Duration;
use tempfile::NamedTempFile;

/// How hidden files are named.
const PREFIX: &str = ".fpack-";

/// A hidden file that nobody holds is left over from a program that was killed, once it is as old as this: a new
/// one is there for a moment before it is held.
const LEFT: Duration = Duration::from_secs(10);

/// A hidden file in the folder of `target`, to be renamed to it once it is whole. What programs left there that were
/// killed is removed.
pub(crate) fn beside(target: &Path) -> Result<NamedTempFile> {
    let folder = folder(target);
    std::fs::read_dir(folder)?.flatten().for_each(|entry| remove_if_left(&entry));
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // As readable as any new file: the process's umask is taken off this.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let file = builder.prefix(PREFIX).tempfile_in(folder)?;
    // Where files cannot be locked, none is ever taken for left over.
    let _ = file.as_file().try_lock();
    Ok(file)
}

fn remove_if_left(entry: &DirEntry) {
    if !entry.file_name().to_string_lossy().starts_with(PREFIX) {
        return;
    }
    let Ok(file) = File::open(entry.path()) else { return };
    let age = file.metadata().and_then(|m| m.modified()).ok().and_then(|t| t.elapsed().ok());
    if age.is_some_and(|age| age > LEFT) && file.try_lock().is_ok() {
        // What cannot be removed is tried again the next time.
        let _ = std::fs::remove_file(entry.path());
    }
}

/// Copies a file whole or not at all.
///
/// # Errors
/// When it cannot be read, the folder of the other is not there or cannot be written, or the disk is full.
pub fn copy_whole(from: &Path, to: &Path) -> Result<()> {
    let mut file = beside(to)?;
    std::io::copy(&mut File::open(from)?, &mut file)?;
    file.persist(to).map_err(|e| e.error)?;
    Ok(())
}

/// Writes a file of any kind whole or not at all.
///
/// # Errors
/// When its folder is not there or cannot be written, or the disk is full.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut file = beside(path)?;
    file.write_all(bytes)?;
    file.persist(path).map_err(|e| e.error)?;
    Ok(())
}
