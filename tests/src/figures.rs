//! Figures that tests find out and reports print.
//!
//! `make reliability` names a folder in `FOREST_FIGURES`, and in `FOREST_EFFORT` how many times as much tests shall
//! try; without these nothing is written, and tests try once.

use std::path::{Path, PathBuf};

/// How many times as much is tried.
pub fn effort() -> usize {
    std::env::var("FOREST_EFFORT").ok().and_then(|e| e.parse().ok()).unwrap_or(1)
}

/// Notes a figure, where they are asked for.
///
/// # Panics
/// When it cannot be written.
pub fn note(name: &str, value: f64) {
    if let Some(folder) = std::env::var_os("FOREST_FIGURES").map(PathBuf::from) {
        std::fs::create_dir_all(&folder).expect("a folder for figures");
        std::fs::write(folder.join(name), value.to_string()).expect("a figure is written");
    }
}

/// A figure that was noted in `folder`.
pub fn noted(folder: &Path, name: &str) -> Option<f64> {
    std::fs::read_to_string(folder.join(name)).ok()?.parse().ok()
}
