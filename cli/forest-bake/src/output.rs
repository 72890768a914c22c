//! Data on stdout, everything else on stderr.

use crate::failure::Usage;
use crate::log::Log;
use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{ErrorKind, Write};
use std::path::Path;

/// Prints to stdout; a reader that has seen enough (`| head`) is no error.
pub(crate) fn print(text: &str) -> std::io::Result<()> {
    print_bytes(text.as_bytes())
}

/// As [`print()`], of what is no text.
pub(crate) fn print_bytes(bytes: &[u8]) -> std::io::Result<()> {
    match std::io::stdout().write_all(bytes) {
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
        result => result,
    }
}

/// A bar on a terminal, nothing elsewhere.
pub(crate) fn bar(total: u64, what: &'static str, log: Log) -> ProgressBar {
    let target =
        if log.says() { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
    let bar = ProgressBar::with_draw_target(Some(total), target);
    let template = "{msg} [{bar:40}] {human_pos}/{human_len} {eta}";
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.progress_chars("=> "));
    }
    bar.set_message(what);
    bar
}

/// A number of bytes for people.
pub(crate) fn bytes(n: u64) -> String {
    indicatif::HumanBytes(n).to_string()
}

/// A count with separators.
pub(crate) fn count(n: u64) -> String {
    indicatif::HumanCount(n).to_string()
}

/// Whether a file of this extension can be written there: before hours of work, not after.
pub(crate) fn check_target(path: &Path, extension: &str) -> Result<()> {
    let name = path.display();
    if path.extension().is_none_or(|e| !e.eq_ignore_ascii_case(extension)) {
        return Err(Usage(format!("{name}: is written as .{extension}")).into());
    }
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let there = std::fs::metadata(folder).with_context(|| format!("{name}: its folder"))?;
    if !there.is_dir() {
        return Err(Usage(format!("{name}: {} is not a folder", folder.display())).into());
    }
    Ok(())
}

/// Writes a file whole or not at all.
pub(crate) fn write_file(path: &Path, bytes: &[u8]) -> Result<()> {
    forest_pack::write_whole(path, bytes).with_context(|| path.display().to_string())
}

/// Most memory that the program has held, in bytes, where the system tells.
pub(crate) fn peak_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes * 1024)
}
