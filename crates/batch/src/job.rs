//! Jobs: one asset each, named by what it is made of.

use crate::inputs::{Input, Stamp};
use crate::manifest::Asset;
use crate::state::{Record, State};
use std::fmt::{Display, Formatter, Result};
use std::path::{Path, PathBuf};

/// One asset to be baked.
#[derive(Clone, Debug)]
pub struct Job {
    /// Which, and how.
    pub asset: Asset,
    /// The arguments of `forest-bake all`, but for trees and places of output.
    pub arguments: Vec<String>,
    /// What it is made of.
    pub inputs: Vec<Input>,
    /// BLAKE3 of all that decides over the bytes of its outputs, in hexadecimal.
    pub key: String,
}

/// Why a job is to be run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reason {
    /// It never was.
    New,
    /// It is asked for.
    Forced,
    /// It failed, and might not now.
    FailedBefore,
    /// Another program baked it.
    OtherBaker,
    /// Its options were others.
    Options(String),
    /// It is made of other files.
    Input(PathBuf, &'static str),
    /// What it made is not there any more, or not as it was.
    Output(PathBuf, &'static str),
}

impl Display for Reason {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Self::New => f.write_str("is new"),
            Self::Forced => f.write_str("is forced"),
            Self::FailedBefore => f.write_str("failed before"),
            Self::OtherBaker => f.write_str("was baked by another build of forest-bake"),
            Self::Options(what) => write!(f, "options: {what}"),
            Self::Input(path, what) | Self::Output(path, what) => {
                write!(f, "{} {what}", path.display())
            }
        }
    }
}

impl Job {
    /// The job of an asset that is made of `inputs`, for the baker `baker` names.
    pub fn new(asset: Asset, inputs: Vec<Input>, baker: &str) -> Self {
        let arguments = asset.settings.arguments();
        let mut hasher = blake3::Hasher::new_derive_key("forest-bake job 1");
        let mut put = |text: &str| {
            hasher.update(&(text.len() as u64).to_le_bytes());
            hasher.update(text.as_bytes());
        };
        put(baker);
        // Exported files have the asset's name.
        put(&asset.name);
        arguments.iter().for_each(|a| put(a));
        put("trees");
        // Where files lie does not matter, but how trees are placed does.
        for tree in &asset.trees {
            put(Path::new(tree).file_name().unwrap_or_default().to_string_lossy().as_ref());
        }
        put("files");
        for input in &inputs {
            put(input.hash.as_deref().unwrap_or("none"));
        }
        let key = hasher.finalize().to_hex().to_string();
        Self { asset, arguments, inputs, key }
    }

    /// Why it is to be run, if it is; `record` is of the last time.
    pub fn reason(&self, record: Option<&Record>, baker: &str) -> Option<Reason> {
        let Some(record) = record else { return Some(Reason::New) };
        if record.key != self.key {
            return Some(self.difference(record, baker));
        }
        match &record.outcome {
            Ok(_) => record.outputs.iter().find_map(changed),
            // The same bytes are refused the same way.
            Err(failure) if failure.is_the_inputs() => None,
            Err(_) => Some(Reason::FailedBefore),
        }
    }

    fn difference(&self, record: &Record, baker: &str) -> Reason {
        if record.baker != baker {
            return Reason::OtherBaker;
        }
        let gone = record.arguments.iter().filter(|a| !self.arguments.contains(a));
        let new = self.arguments.iter().filter(|a| !record.arguments.contains(a));
        let told: Vec<String> =
            gone.map(|a| format!("without {a}")).chain(new.map(|a| format!("with {a}"))).collect();
        if !told.is_empty() {
            return Reason::Options(told.join(", "));
        }
        for input in &self.inputs {
            let what = match record.inputs.iter().find(|i| i.path == input.path) {
                Some(old) if old.hash == input.hash => continue,
                Some(old) if old.hash.is_none() => "was not there",
                Some(_) if input.hash.is_none() => "is not there",
                Some(_) => "has changed",
                None => "is new to it",
            };
            return Reason::Input(input.path.clone(), what);
        }
        let left = record.inputs.iter().find(|i| self.inputs.iter().all(|n| n.path != i.path));
        match left {
            Some(left) => Reason::Input(left.path.clone(), "is not used any more"),
            None => Reason::Options("trees are placed otherwise".into()),
        }
    }

    /// Bytes of memory that it is expected to need, and seconds on one thread: as the last time, else by the size
    /// of its files.
    pub fn estimate(&self, state: &State) -> (u64, f64) {
        if let Some(Ok(done)) = state.record(&self.asset.name).map(|r| r.outcome) {
            // It may need a little more where more runs beside it.
            let peak = done.peak_bytes.map(|b| b + b / 8);
            return (peak.unwrap_or_else(|| self.guess().0), done.seconds);
        }
        self.guess()
    }

    fn guess(&self) -> (u64, f64) {
        let size = |i: &Input| std::fs::metadata(&i.path).map_or(0, |m| m.len());
        let bytes: u64 = self.inputs.iter().map(size).sum();
        (LEAST_MEMORY + bytes * MEMORY_A_BYTE, LEAST_SECONDS + bytes as f64 * SECONDS_A_BYTE)
    }
}

/// Of jobs that were never run: measured on the sample trees and real ones, the larger side of what was found.
const LEAST_MEMORY: u64 = 512 << 20;
const MEMORY_A_BYTE: u64 = 48;
const LEAST_SECONDS: f64 = 2.0;
const SECONDS_A_BYTE: f64 = 4e-6;

fn changed(output: &crate::state::Output) -> Option<Reason> {
    let told = |what| Some(Reason::Output(output.path.clone(), what));
    match std::fs::metadata(&output.path) {
        Err(_) => told("is not there"),
        Ok(now) if Stamp::of(&now) == output.stamp => None,
        // Copied about, perhaps.
        Ok(now) if now.len() == output.stamp.bytes && output.has_its_hash() => None,
        Ok(_) => told("is not as it was baked"),
    }
}
