//! What a bake tells while it works: one JSON object a line.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Names the form of [`Line`]; it changes when a reader of the old one would misunderstand the new.
pub(crate) const SCHEMA: &str = "forest-bake/event/1";

/// One line of the log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Line {
    /// `forest-bake/event/1`.
    pub schema: String,
    /// The asset, of a batch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub asset: Option<String>,
    /// What happened.
    #[serde(flatten)]
    pub event: Event,
}

/// What happened.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "event", rename_all = "kebab-case")]
pub enum Event {
    /// A bake begins.
    Start {
        /// Trees, as they were named.
        sources: Vec<String>,
        /// The pack that is to be written.
        output: PathBuf,
    },
    /// A part of it is done.
    Stage {
        /// import, points, views, volume, foliage, judge, needs or export.
        stage: String,
        /// Time that it took.
        seconds: f64,
    },
    /// Something is odd, and the bake goes on.
    Warning {
        /// What, in words.
        text: String,
    },
    /// All is written.
    Done(Done),
    /// It could not be done.
    Failed {
        /// Why, in words.
        error: String,
        /// The exit code of the bake; none if it did not end by itself.
        code: Option<u8>,
    },
    /// Nothing was to be done.
    Current {
        /// The pack that is there.
        output: PathBuf,
    },
}

/// What a bake made.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Done {
    /// The pack.
    pub output: PathBuf,
    /// Further files, in the order of their names.
    #[serde(default)]
    pub exports: Vec<PathBuf>,
    /// Bytes of the pack.
    pub bytes: u64,
    /// How many there are: `points.points`, `views.views`, `foliage.level0.triangles` …
    pub counts: BTreeMap<String, u64>,
    /// Errors that were measured: `points.flip` …, less is better.
    pub errors: BTreeMap<String, f64>,
    /// Time from start to end.
    pub seconds: f64,
    /// Most memory that it held, in bytes; none where the system does not tell.
    pub peak_bytes: Option<u64>,
}

impl Line {
    /// An event of `asset`, if there are several.
    pub fn new(asset: Option<&str>, event: Event) -> Self {
        Self { schema: SCHEMA.into(), asset: asset.map(Into::into), event }
    }

    /// The line, with its end.
    pub fn text(&self) -> String {
        let mut text = serde_json::to_string(self).expect("names and numbers");
        text.push('\n');
        text
    }

    /// Reads a line; `None` if it is not one.
    pub fn read(text: &str) -> Option<Self> {
        serde_json::from_str::<Self>(text).ok().filter(|l| l.schema == SCHEMA)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_read_as_it_was_written() {
        let counts = BTreeMap::from([("points.points".to_string(), 7)]);
        let events = [
            Event::Start { sources: vec!["a b.glb@1,2,3".into()], output: "x.fpack".into() },
            Event::Stage { stage: "views".into(), seconds: 0.25 },
            Event::Warning { text: "two\nlines \"quoted\"".into() },
            Event::Done(Done { bytes: 9, counts, ..Done::default() }),
            Event::Failed { error: "no".into(), code: None },
            Event::Current { output: "x.fpack".into() },
        ];
        for event in events {
            let line = Line::new(Some("oak"), event);
            let text = line.text();
            assert_eq!(text.matches('\n').count(), 1, "one line: {text:?}");
            assert_eq!(Line::read(&text), Some(line));
        }
        assert_eq!(Line::read("thread 'main' panicked"), None);
        assert_eq!(Line::read(r#"{"schema":"other/1","event":"start"}"#), None);
    }
}
