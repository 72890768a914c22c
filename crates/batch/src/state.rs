//! What earlier runs made: a record an asset, in a folder beside the manifest.

use crate::error::BatchError;
use crate::event::Done;
use crate::inputs::{Input, Stamp};
use crate::manifest::folder_of;
use serde::{Deserialize, Serialize};
use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};

/// The form of records.
const FORM: u32 = 1;

/// What was made of an asset, of what, and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    form: u32,
    /// [`crate::Job::key`].
    pub key: String,
    /// Which program baked it.
    pub baker: String,
    /// How.
    pub arguments: Vec<String>,
    /// Of what.
    pub inputs: Vec<Input>,
    /// Which files.
    pub outputs: Vec<Output>,
    /// What was told of it.
    pub outcome: Result<Done, Failure>,
}

/// A file that was made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Output {
    /// Where it was put.
    pub path: PathBuf,
    /// BLAKE3 of its bytes in hexadecimal.
    pub hash: String,
    pub(crate) stamp: Stamp,
}

/// Why an asset could not be baked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Failure {
    /// In words.
    pub error: String,
    /// The exit code; none if the bake did not end by itself.
    pub code: Option<u8>,
}

impl Failure {
    /// Whether it says that the inputs are wrong (usage, invalid, not supported), and not the circumstances.
    pub fn is_the_inputs(&self) -> bool {
        matches!(self.code, Some(1 | 3 | 5))
    }
}

impl Output {
    /// Looks at a file that was just made.
    pub(crate) fn of(path: &Path) -> std::io::Result<Self> {
        let mut hasher = blake3::Hasher::new();
        let mut file = File::open(path)?;
        let stamp = Stamp::of(&file.metadata()?);
        std::io::copy(&mut file, &mut hasher)?;
        Ok(Self { path: path.into(), hash: hasher.finalize().to_hex().to_string(), stamp })
    }

    pub(crate) fn has_its_hash(&self) -> bool {
        Self::of(&self.path).is_ok_and(|now| now.hash == self.hash)
    }
}

impl Record {
    pub(crate) fn new(
        job: &crate::Job,
        baker: &str,
        outputs: Vec<Output>,
        outcome: Result<Done, Failure>,
    ) -> Self {
        Self {
            form: FORM,
            key: job.key.clone(),
            baker: baker.into(),
            arguments: job.arguments.clone(),
            inputs: job.inputs.clone(),
            outputs,
            outcome,
        }
    }
}

/// The folder of records.
#[derive(Clone, Debug)]
pub struct State {
    folder: PathBuf,
}

/// An asset that nobody else bakes meanwhile.
#[derive(Debug)]
pub(crate) struct Held {
    /// Locked as long as it is open.
    _lock: File,
}

impl State {
    /// The records of a manifest, in `.forest-bake/NAME` beside it.
    ///
    /// # Errors
    /// When the folder cannot be made.
    pub fn open(manifest: &Path) -> Result<Self, BatchError> {
        let name = manifest.file_stem().unwrap_or_default();
        let folder = folder_of(manifest).join(".forest-bake").join(name);
        std::fs::create_dir_all(&folder).map_err(BatchError::io(&folder))?;
        Ok(Self { folder })
    }

    /// Where the hashes of files are remembered.
    pub fn memo(&self) -> PathBuf {
        // No asset's name starts with a dot.
        self.folder.join(".files.json")
    }

    /// What was made of an asset; nothing if that is not known.
    pub fn record(&self, name: &str) -> Option<Record> {
        let bytes = std::fs::read(self.path(name, "json")).ok()?;
        serde_json::from_slice(&bytes).ok().filter(|r: &Record| r.form == FORM)
    }

    pub(crate) fn put(&self, name: &str, record: &Record) -> Result<(), BatchError> {
        let path = self.path(name, "json");
        let text = serde_json::to_vec_pretty(record).expect("names and numbers");
        forest_pack::write_whole(&path, &text).map_err(BatchError::io(&path))
    }

    /// Holds an asset; none while another run does.
    pub(crate) fn hold(&self, name: &str) -> Result<Option<Held>, BatchError> {
        let path = self.path(name, "lock");
        let file = File::create(&path).map_err(BatchError::io(&path))?;
        match file.try_lock() {
            Ok(()) => Ok(Some(Held { _lock: file })),
            Err(TryLockError::WouldBlock) => Ok(None),
            Err(TryLockError::Error(e)) => Err(BatchError::io(&path)(e)),
        }
    }

    fn path(&self, name: &str, extension: &str) -> PathBuf {
        self.folder.join(format!("{name}.{extension}"))
    }
}
