//! Many bakes: which assets there are, how each is baked, and what is to be done again.
//!
//! A [`Manifest`] (TOML) names files and settings; each of its [`Asset`]s becomes a [`Job`], named by a hash over all that
//! decides over its bytes: the files it is made of with those that they refer to ([`Memo`]), its options, and
//! the baker. [`State`] remembers what was made; a [`Runner`] runs the jobs that are not as they were, each as a
//! process of its own, and tells what happens in [`Line`]s. A [`Cache`] keeps finished bakes by those names,
//! for several machines.
//!
//! ```
//! use forest_batch::{Job, Manifest, Memo};
//! use std::path::Path;
//!
//! let folder = tempfile::tempdir().unwrap();
//! let file = folder.path().join("forest.toml");
//! std::fs::write(folder.path().join("leaf.obj"), "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n").unwrap();
//! let text = "version = 1\nbake.preset = \"draft\"\n[[asset]]\nfiles = [\"*.obj\"]\n";
//! let asset = Manifest::parse(text, &file).unwrap().assets(&file).unwrap().remove(0);
//! let inputs = Memo::default().inputs(&[&asset.trees]).unwrap().remove(0);
//! let job = Job::new(asset.clone(), inputs.clone(), "baker 1");
//! assert_ne!(job.key, Job::new(asset, inputs, "baker 2").key);
//! assert!(job.reason(None, "baker 1").is_some(), "it was never baked");
//! ```
//!
//! How others do it, and what of it is meant here: builds by hashes of what they are made of (A. Mokhov,
//! N. Mitchell, S. Peyton Jones, "Build systems à la carte", ICFP 2018: verifying traces, and constructive ones in
//! the cache).

mod cache;
mod compare;
mod error;
mod event;
mod graph;
mod inputs;
mod job;
mod manifest;
mod run;
mod settings;
mod state;
mod summary;
mod work;

pub use cache::Cache;
pub use compare::{Worse, worse};
pub use error::BatchError;
pub use event::{Done, Event, Line};
pub use graph::{JobGraph, JobNode};
pub use inputs::{Input, Memo};
pub use job::{Job, Reason};
pub use manifest::{Asset, Entry, Manifest, Override};
pub use run::{Outcome, Runner};
pub use settings::{OptionValue, Options, Settings};
pub use state::{Failure, Output, Record, State};
pub use summary::{AssetSummary, Status, Summary};
pub use work::WorkFolder;

use std::path::Path;

/// What names a baker in keys: its version, and the hash of the program.
///
/// # Errors
/// When the program cannot be read.
pub fn baker(program: &Path, version: &str) -> Result<String, BatchError> {
    let mut hasher = blake3::Hasher::new();
    let mut file = std::fs::File::open(program).map_err(BatchError::io(program))?;
    std::io::copy(&mut file, &mut hasher).map_err(BatchError::io(program))?;
    Ok(format!("forest-bake {version} {}", hasher.finalize().to_hex()))
}

/// The JSON schema of the lines of a log.
pub fn event_schema() -> String {
    pretty(&schemars::schema_for!(Line))
}

/// The JSON schema of a summary.
pub fn summary_schema() -> String {
    pretty(&schemars::schema_for!(Summary))
}

/// The JSON schema of a job graph.
pub fn graph_schema() -> String {
    pretty(&schemars::schema_for!(JobGraph))
}

/// The JSON schema of a manifest, which is TOML.
pub fn manifest_schema() -> String {
    pretty(&schemars::schema_for!(Manifest))
}

fn pretty(schema: &schemars::Schema) -> String {
    serde_json::to_string_pretty(schema).expect("a schema is JSON") + "\n"
}
