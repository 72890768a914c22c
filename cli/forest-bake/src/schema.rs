//! `forest-bake schema`.

use crate::output;
use anyhow::Result;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Which; default: all, as one JSON object by their names.
    #[arg(value_enum)]
    name: Option<Name>,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Name {
    /// A manifest of `batch` (TOML).
    Manifest,
    /// A line of --log json.
    Event,
    /// `batch --summary`.
    Batch,
    /// `batch --jobs-json`.
    Jobs,
    /// `eval --json`.
    Eval,
}

impl Name {
    fn schema(self) -> String {
        match self {
            Self::Manifest => forest_batch::manifest_schema(),
            Self::Event => forest_batch::event_schema(),
            Self::Batch => forest_batch::summary_schema(),
            Self::Jobs => forest_batch::graph_schema(),
            Self::Eval => forest_eval::json_schema(),
        }
    }
}

pub(crate) fn run(args: &Args) -> Result<()> {
    if let Some(name) = args.name {
        return Ok(output::print(&name.schema())?);
    }
    let mut all = serde_json::Map::new();
    for name in <Name as clap::ValueEnum>::value_variants() {
        let value = clap::ValueEnum::to_possible_value(name);
        let key = value.map(|v| v.get_name().to_string()).unwrap_or_default();
        all.insert(key, serde_json::from_str(&name.schema())?);
    }
    Ok(output::print(&(serde_json::to_string_pretty(&all)? + "\n"))?)
}
