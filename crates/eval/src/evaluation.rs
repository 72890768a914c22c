//! The result of an evaluation, as it is written for programs.

use crate::contender::Contender;
use crate::frame::View;
use crate::metrics::Errors;
use crate::path::PoppingRow;
use crate::plan::{BACKGROUND, Plan};
use crate::ratio::{Metric, Ratio, ratios};
use crate::sweep::{Row, Sweep};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Name and version of the layout. It changes when a field changes its meaning or goes.
pub const SCHEMA: &str = "forest-bake/eval/1";

/// Everything that an evaluation found.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Evaluation {
    /// Name and version of this layout.
    pub schema: String,
    /// What was judged and how.
    pub subject: Subject,
    /// View directions; rows refer to them by index.
    pub views: Vec<View>,
    /// What was compared.
    pub contenders: Vec<ContenderInfo>,
    /// One picture each.
    pub rows: Vec<Row>,
    /// Primitives at equal error, compared with the pack, and with the pack without calibration.
    pub ratios: Vec<Ratio>,
    /// Changes of pictures across switches of level.
    pub popping: Vec<PoppingRow>,
}

/// What was judged and how.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct Subject {
    /// Program and version.
    pub generator: String,
    /// The command, as it was given.
    pub command: String,
    /// The pack.
    pub pack: String,
    /// Size of the pack in bytes.
    pub pack_bytes: u64,
    /// Whether the pack carries calibrated areas.
    pub calibrated: bool,
    /// The source files.
    pub source: Vec<String>,
    /// Triangles of the source.
    pub triangles: u64,
    /// Points of the pack, all levels.
    pub points: u64,
    /// Processor.
    pub machine: String,
    /// Threads used.
    pub threads: u64,
    /// What drew the pictures whose times are given.
    pub renderer: String,
    /// `albedo` or `sun`.
    pub light: String,
    /// Samples of a pixel at the largest height.
    pub samples: u64,
    /// Linear grey behind the pictures.
    pub background: f32,
    /// Heights of the tree in pixels.
    pub heights: Vec<u32>,
    /// Seconds that the evaluation took.
    pub seconds: f64,
}

/// A contender's name and meaning.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct ContenderInfo {
    /// As rows name it.
    pub name: String,
    /// What it is.
    pub what: String,
}

/// A contender at one height and setting: means over the views.
#[derive(Clone, Debug)]
pub struct Summary<'a> {
    /// The first of the rows: contender, height, knob and times.
    pub row: &'a Row,
    /// Mean number of primitives.
    pub primitives: f64,
    /// Mean bytes.
    pub bytes: f64,
    /// Mean errors.
    pub errors: Errors,
    /// Largest FLIP and RMSE of a view.
    pub worst: [f64; 2],
}

impl Evaluation {
    /// Puts a sweep and what it judged together.
    pub fn new(mut subject: Subject, plan: &Plan, contenders: &[Contender], sweep: Sweep) -> Self {
        subject.renderer = "forest-raster, CPU".into();
        subject.light = plan.light_name().into();
        subject.samples = plan.sampling.count() as u64;
        subject.background = BACKGROUND;
        subject.heights.clone_from(&plan.heights);
        let info = |c: &Contender| ContenderInfo { name: c.name.into(), what: c.what.into() };
        Self {
            schema: SCHEMA.into(),
            subject,
            views: sweep.views,
            contenders: contenders.iter().map(info).collect(),
            ratios: ["pack", "raw"].iter().flat_map(|base| ratios(&sweep.rows, base)).collect(),
            rows: sweep.rows,
            popping: sweep.popping,
        }
    }

    /// Rows that differ in the view only, summed up: by height, contender and knob.
    pub fn summaries(&self) -> Vec<Summary<'_>> {
        let mut groups: Vec<Vec<&Row>> = Vec::new();
        for height in &self.subject.heights {
            for contender in &self.contenders {
                let first = groups.len();
                let of = |r: &&Row| r.height == *height && r.contender == contender.name;
                for row in self.rows.iter().filter(of) {
                    match groups[first..].iter_mut().find(|g| g[0].knob == row.knob) {
                        Some(group) => group.push(row),
                        None => groups.push(vec![row]),
                    }
                }
            }
        }
        groups.into_iter().map(|g| Summary::new(&g)).collect()
    }

    /// The ratio of primitives of `other` and `base` at `height`, if they share errors.
    pub fn ratio(&self, base: &str, other: &str, metric: Metric, height: u32) -> Option<&Ratio> {
        self.ratios
            .iter()
            .filter(|r| r.base == base && r.other == other)
            .find(|r| r.metric == metric && r.height == height)
    }
}

impl<'a> Summary<'a> {
    /// Means of rows, at least one.
    pub(crate) fn new(rows: &[&'a Row]) -> Self {
        let n = rows.len() as f64;
        let errors: Vec<Errors> = rows.iter().map(|r| r.errors).collect();
        let worst = |of: fn(&Errors) -> f64| errors.iter().map(of).fold(0.0, f64::max);
        Self {
            row: rows[0],
            primitives: rows.iter().map(|r| r.cost.primitives).sum::<f64>() / n,
            bytes: rows.iter().map(|r| r.cost.bytes).sum::<f64>() / n,
            errors: Errors::mean(&errors).expect("at least one row"),
            worst: [worst(|e| e.flip), worst(|e| e.rmse)],
        }
    }
}

/// The published JSON Schema of [`Evaluation`].
pub fn json_schema() -> String {
    let schema = schemars::schema_for!(Evaluation);
    serde_json::to_string_pretty(&schema).expect("a schema is JSON") + "\n"
}

/// The processor's name, as the system tells it.
pub fn machine() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = info.lines().find_map(|l| l.strip_prefix("model name"));
    let name = model.map_or(std::env::consts::ARCH, |m| m.trim_start_matches([' ', '\t', ':']));
    name.to_string()
}
