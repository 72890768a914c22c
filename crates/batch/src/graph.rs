//! Jobs as other programs run them.

use crate::job::Job;
use crate::state::State;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Names the form of [`JobGraph`].
const SCHEMA: &str = "forest-bake/jobs/1";

/// All jobs of a batch. None needs what another makes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JobGraph {
    /// `forest-bake/jobs/1`.
    pub schema: String,
    /// The jobs, in the order of their names.
    pub jobs: Vec<JobNode>,
}

/// A job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JobNode {
    /// The asset.
    pub name: String,
    /// Files that it is made of.
    pub inputs: Vec<PathBuf>,
    /// Files that are known to be made: the pack.
    pub outputs: Vec<PathBuf>,
    /// The program and its arguments.
    pub command: Vec<String>,
    /// BLAKE3 of all that decides over the bytes of its outputs, in hexadecimal.
    pub hash: String,
    /// Memory that it is expected to need, in bytes: as the last time, else by the size of its files.
    pub memory_bytes: u64,
    /// Time that it is expected to take.
    pub seconds: f64,
}

impl JobGraph {
    /// Of jobs; `manifest` is baked by `program`.
    pub fn new<'a>(
        jobs: impl Iterator<Item = &'a Job>,
        state: &State,
        program: &str,
        manifest: &Path,
    ) -> Self {
        let node = |job: &Job| {
            let (memory_bytes, seconds) = job.estimate(state);
            let there = job.inputs.iter().filter(|i| i.hash.is_some());
            let manifest = manifest.to_string_lossy();
            let command = [program, "batch", &manifest, "--only", &job.asset.name];
            JobNode {
                name: job.asset.name.clone(),
                inputs: there.map(|i| i.path.clone()).collect(),
                outputs: vec![job.asset.output.clone()],
                command: command.map(String::from).to_vec(),
                hash: job.key.clone(),
                memory_bytes,
                seconds,
            }
        };
        Self { schema: SCHEMA.into(), jobs: jobs.map(node).collect() }
    }
}
