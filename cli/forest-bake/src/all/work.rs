//! The folder in which a bake works: beside its target, so that what is finished takes its name by a rename.

use anyhow::{Context, Result};
use forest_batch::WorkFolder;
use std::io::Read;
use std::path::{Path, PathBuf};

/// How such folders are named.
const PREFIX: &str = ".forest-bake-work-";

/// Name of the pack in it.
pub(super) const PACK: &str = "pack.fpack";

/// The folder; it goes away with this.
pub(super) struct Work {
    folder: WorkFolder,
}

impl Work {
    /// A folder beside `output`. What bakes left there that were killed is removed.
    pub(super) fn beside(output: &Path) -> Result<Self> {
        let beside = folder_of(output);
        let told = || beside.display().to_string();
        let folder = WorkFolder::new(beside, PREFIX).with_context(told)?;
        std::fs::create_dir(folder.path().join("exports")).with_context(told)?;
        std::fs::create_dir(folder.path().join("pruned")).with_context(told)?;
        Ok(Self { folder })
    }

    pub(super) fn pack(&self) -> PathBuf {
        self.folder.path().join(PACK)
    }

    pub(super) fn pruned(&self) -> PathBuf {
        self.folder.path().join("pruned")
    }

    pub(super) fn exports(&self) -> PathBuf {
        self.folder.path().join("exports")
    }

    /// Gives what was made its names: exports first, the pack last. Returns the exports.
    pub(super) fn install(&self, exports: Option<&Path>, output: &Path) -> Result<Vec<PathBuf>> {
        let mut out = Vec::new();
        if let Some(to) = exports {
            let mut files: Vec<PathBuf> = Vec::new();
            for entry in std::fs::read_dir(self.exports())? {
                files.push(entry?.path());
            }
            files.sort();
            if !files.is_empty() {
                std::fs::create_dir_all(to).with_context(|| to.display().to_string())?;
            }
            for from in files {
                let to = to.join(from.file_name().unwrap_or_default());
                // The folder may lie on another disk.
                let moved =
                    std::fs::rename(&from, &to).or_else(|_| forest_pack::copy_whole(&from, &to));
                moved.with_context(|| to.display().to_string())?;
                out.push(to);
            }
        }
        std::fs::rename(self.pack(), output).with_context(|| output.display().to_string())?;
        Ok(out)
    }
}

fn folder_of(output: &Path) -> &Path {
    output.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Ends the program when its stdin does: a batch that was killed takes its bakes with it.
pub(super) fn stop_when_stdin_ends() {
    std::thread::spawn(|| {
        let mut byte = [0; 64];
        while std::io::stdin().read(&mut byte).is_ok_and(|n| n > 0) {}
        std::process::exit(130);
    });
}
