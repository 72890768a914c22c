//! What became of a batch, for people and programs.

use crate::event::Done;
use crate::manifest::Asset;
use crate::run::Outcome;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Names the form of [`Summary`].
const SCHEMA: &str = "forest-bake/batch/1";

/// What became of all assets, in the order of their names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Summary {
    /// `forest-bake/batch/1`.
    pub schema: String,
    /// The baker and its version.
    pub generator: String,
    /// Time of the run.
    pub seconds: f64,
    /// The assets.
    pub assets: Vec<AssetSummary>,
}

/// What became of an asset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AssetSummary {
    /// Its name.
    pub name: String,
    /// Whether it is there.
    pub status: Status,
    /// Why not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// What it is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub done: Option<Done>,
}

/// Whether an asset is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// It was baked, or taken out of the cache.
    Baked,
    /// It was there.
    Current,
    /// It could not be baked.
    Failed,
    /// It was not tried.
    Left,
}

impl Status {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Baked => "baked",
            Self::Current => "current",
            Self::Failed => "failed",
            Self::Left => "left",
        }
    }
}

impl Summary {
    /// Of assets and what became of them.
    pub fn new(assets: &[&Asset], outcomes: &[Outcome], generator: &str, seconds: f64) -> Self {
        let one = |(asset, outcome): (&&Asset, &Outcome)| {
            let (status, error, done) = match outcome {
                Outcome::Baked(done) => (Status::Baked, None, Some(done.clone())),
                Outcome::Current(done) => (Status::Current, None, Some(done.clone())),
                Outcome::Failed(failure) => (Status::Failed, Some(failure.error.clone()), None),
                Outcome::Left => (Status::Left, None, None),
            };
            AssetSummary { name: asset.name.clone(), status, error, done }
        };
        let assets = assets.iter().zip(outcomes).map(one).collect();
        Self { schema: SCHEMA.into(), generator: generator.into(), seconds, assets }
    }

    /// Reads what was written as JSON.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub fn parse(text: &str) -> Result<Self, String> {
        let summary: Self = serde_json::from_str(text).map_err(|e| e.to_string())?;
        match summary.schema == SCHEMA {
            true => Ok(summary),
            false => Err(format!("schema {:?}; this build reads {SCHEMA:?}", summary.schema)),
        }
    }

    /// How many assets have this status.
    pub fn count(&self, status: Status) -> usize {
        self.assets.iter().filter(|a| a.status == status).count()
    }
}
