//! Files that appear whole or not at all.

use std::io::{Result, Write};
use std::path::Path;
use tempfile::NamedTempFile;

/// A hidden file in the folder of `target`, to be renamed to it once it is whole.
pub(crate) fn beside(target: &Path) -> Result<NamedTempFile> {
    let folder = target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // As readable as any new file: the process's umask is taken off this.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder.prefix(".fpack-").tempfile_in(folder)
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
