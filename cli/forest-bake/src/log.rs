//! What a command tells on stderr: sentences for people, or one JSON event a line.

use forest_batch::{Event, Line};
use std::fmt::Display;
use std::io::Write;

/// Who is told, and how much.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Log {
    pub(crate) form: Form,
    pub(crate) quiet: bool,
    pub(crate) verbose: bool,
    /// What is done is a part of something larger, which tells of itself: warnings only.
    pub(crate) part: bool,
}

/// In which form.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Form {
    /// Sentences.
    Text,
    /// One JSON object a line (`forest-bake schema event`).
    Json,
}

impl Log {
    /// Whether people are told what is done.
    pub(crate) fn says(self) -> bool {
        self.form == Form::Text && !self.quiet && !self.part
    }

    /// For a part of what is done.
    pub(crate) fn for_part(self) -> Self {
        Self { part: true, ..self }
    }

    /// Something is odd, and the work goes on.
    pub(crate) fn warn(self, text: impl Display) {
        match self.form {
            Form::Json => self.event(Event::Warning { text: text.to_string() }),
            Form::Text if self.quiet => {}
            Form::Text => eprintln!("warning: {text}"),
        }
    }

    /// A part of the work is done.
    pub(crate) fn stage(self, stage: &str, seconds: f64) {
        match self.form {
            Form::Json => self.event(Event::Stage { stage: stage.into(), seconds }),
            Form::Text if self.verbose && !self.quiet => eprintln!("{stage}: {seconds:.2} s"),
            Form::Text => {}
        }
    }

    /// A line for programs; people are told otherwise.
    pub(crate) fn event(self, event: Event) {
        self.line(&Line::new(None, event));
    }

    /// The same, of one asset of several.
    pub(crate) fn line(self, line: &Line) {
        if self.form == Form::Json {
            // Nothing can be done if nobody listens any more.
            let _ = std::io::stderr().write_all(line.text().as_bytes());
        }
    }
}
