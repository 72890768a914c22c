//! What assets are made of: files, what those refer to, and their hashes.
//!
//! Hashes decide; sizes and times of files only say which hashes need not be taken again.

use crate::error::BatchError;
use forest_import::Block;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeSet, HashMap};
use std::fs::{File, Metadata};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

/// A file that an asset is made of.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Input {
    /// Where it is.
    pub path: PathBuf,
    /// BLAKE3 of its bytes in hexadecimal; none if it is not there.
    pub hash: Option<String>,
}

/// Files by their places: what is known of them, as of earlier runs too.
#[derive(Debug, Default)]
pub struct Memo {
    known: HashMap<PathBuf, Known>,
    changed: bool,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Known {
    stamp: Stamp,
    hash: String,
    /// Files that it refers to.
    names: Vec<PathBuf>,
}

/// By what a file is known again without being read.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Stamp {
    pub(crate) bytes: u64,
    /// Nanoseconds since 1970.
    pub(crate) modified: u64,
}

/// A file that was written within so many nanoseconds before it was hashed may have been written again within
/// the same tick of its file system's clock.
const TICK: u64 = 2_000_000_000;

impl Stamp {
    pub(crate) fn of(metadata: &Metadata) -> Self {
        let modified = metadata.modified().map_or(0, nanoseconds);
        Self { bytes: metadata.len(), modified }
    }
}

fn nanoseconds(time: SystemTime) -> u64 {
    time.duration_since(UNIX_EPOCH).map_or(0, |d| d.as_nanos() as u64)
}

impl Memo {
    /// What a file remembers; nothing if it is not there or of another form.
    pub fn read(path: &Path) -> Self {
        let read = || serde_json::from_slice(&std::fs::read(path).ok()?).ok();
        Self { known: read().unwrap_or_default(), changed: false }
    }

    /// Remembers for the next run.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), BatchError> {
        if !self.changed {
            return Ok(());
        }
        let text = serde_json::to_vec(&self.known).expect("names and numbers");
        forest_pack::write_whole(path, &text).map_err(BatchError::io(path))
    }

    /// The files of each of several assets, given as their trees: those that are named, then what these refer to.
    ///
    /// # Errors
    /// The asset's number, when its trees make no sense.
    pub fn inputs(
        &mut self,
        assets: &[&[String]],
    ) -> Result<Vec<Vec<Input>>, (usize, forest_import::ImportError)> {
        let mut named: Vec<Vec<PathBuf>> = Vec::new();
        for (i, trees) in assets.iter().enumerate() {
            named.push(files(trees).map_err(|e| (i, e))?);
        }
        self.learn(named.iter().flatten());
        for files in &mut named {
            let inner = files.iter().filter_map(|f| self.known.get(f));
            let inner: Vec<PathBuf> = inner.flat_map(|k| k.names.clone()).collect();
            for file in inner {
                if !files.contains(&file) {
                    files.push(file);
                }
            }
        }
        self.learn(named.iter().flatten());
        let input = |path: PathBuf| {
            let hash = self.known.get(&path).map(|k| k.hash.clone());
            Input { path, hash }
        };
        Ok(named.into_iter().map(|files| files.into_iter().map(input).collect()).collect())
    }

    /// Looks at files, and reads those that are not as they were.
    fn learn<'a>(&mut self, paths: impl Iterator<Item = &'a PathBuf>) {
        let unique: BTreeSet<&PathBuf> = paths.collect();
        let known = &self.known;
        let new: Vec<(&PathBuf, Option<Known>)> = unique
            .into_par_iter()
            .filter_map(|path| {
                let now = std::fs::metadata(path).ok().filter(Metadata::is_file);
                let old = known.get(path);
                match (&now, old) {
                    (Some(now), Some(old)) if old.stamp == Stamp::of(now) => None,
                    (None, None) => None,
                    _ => Some((path, now.and_then(|_| Known::of(path).ok()))),
                }
            })
            .collect();
        for (path, found) in new {
            self.changed = true;
            match found {
                Some(found) => self.known.insert(path.clone(), found),
                None => self.known.remove(path),
            };
        }
    }
}

impl Known {
    fn of(path: &Path) -> std::io::Result<Self> {
        let mut file = File::open(path)?;
        // Before the bytes: what is written meanwhile is noticed the next time.
        let mut stamp = Stamp::of(&file.metadata()?);
        let begun = nanoseconds(SystemTime::now());
        let mut hasher = blake3::Hasher::new();
        std::io::copy(&mut file, &mut hasher)?;
        if stamp.modified.saturating_add(TICK) > begun {
            // No file has this time: it is read anew.
            stamp.modified = u64::MAX;
        }
        let names = forest_import::references(path).unwrap_or_default();
        Ok(Self { stamp, hash: hasher.finalize().to_hex().to_string(), names })
    }
}

/// The files that trees name: a block file first, then those of the trees.
fn files(trees: &[String]) -> Result<Vec<PathBuf>, forest_import::ImportError> {
    let captures = |t: &String| Path::new(t).is_dir();
    if let [one] = trees
        && captures(one)
    {
        return Ok(vec![forest_import::transforms_file(Path::new(one))]);
    }
    let mut out: Vec<PathBuf> = Vec::new();
    if let [one] = trees
        && Path::new(one).extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"))
    {
        out.push(one.into());
    }
    for part in Block::parse(trees)?.parts {
        if !out.contains(&part.file) {
            out.push(part.file);
        }
    }
    Ok(out)
}
