//! `forest-bake levels`.

use crate::log::Log;
use crate::output;
use crate::source::{PointsOptions, SourceArgs};
use anyhow::Result;
use forest_points::{BakeOptions, CutAudit, Order, RadiusRule, Thresholds, audit};
use serde::Serialize;
use std::fmt::Write;

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    source: SourceArgs,
    #[command(flatten)]
    options: PointsOptions,
    /// s_M over s_m: where the paper's range of sizes ends.
    #[arg(long, default_value_t = Thresholds::LARGEST_RATIO)]
    ratio: f64,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// One rule and order, audited.
#[derive(Serialize)]
struct Table {
    name: &'static str,
    rows: Vec<Row>,
}

#[derive(Serialize)]
struct Row {
    threshold: f64,
    points: u64,
    area_kept: f64,
    under_ancestor: u64,
    missing: f64,
    doubled: f64,
}

const WAYS: [(&str, RadiusRule, Order); 4] = [
    ("opacity", RadiusRule::Opacity, Order::Exact),
    ("area", RadiusRule::Area, Order::Exact),
    ("paper radius", RadiusRule::Paper, Order::Exact),
    ("paper radius and order", RadiusRule::Paper, Order::Paper),
];

pub(crate) fn run(args: &Args, log: Log) -> Result<()> {
    let source = args.source.load(log)?;
    let options = args.options.bake_options(source.trees)?;
    let mut tables = Vec::new();
    for (name, radius, order) in WAYS {
        let options = BakeOptions { radius, order, triangles: false, ..options };
        let rows = audit(&source.soup, &options, args.ratio)?;
        tables.push(Table { name, rows: rows.iter().map(Row::of).collect() });
    }
    let text = if args.json {
        format!("{}\n", serde_json::to_string_pretty(&tables)?)
    } else {
        text(&tables)?
    };
    Ok(output::print(&text)?)
}

impl Row {
    fn of(a: &CutAudit) -> Self {
        Self {
            threshold: a.threshold,
            points: a.points,
            area_kept: a.area_kept,
            under_ancestor: a.under_ancestor,
            missing: a.missing,
            doubled: a.doubled,
        }
    }
}

/// Levels that differ in any way, finest first.
fn text(tables: &[Table]) -> Result<String, std::fmt::Error> {
    let mut t = String::new();
    for table in tables {
        writeln!(t, "{}", table.name)?;
        writeln!(
            t,
            "  {:>12} {:>12} {:>10} {:>12} {:>9} {:>9}",
            "s_m (area)", "points", "area kept", "with ancest.", "missing", "doubled"
        )?;
        let mut last = u64::MAX;
        for r in table.rows.iter().filter(|r| std::mem::replace(&mut last, r.points) != r.points) {
            writeln!(
                t,
                "  {:>12.2e} {:>12} {:>9.1}% {:>12} {:>8.1}% {:>8.1}%",
                r.threshold,
                output::count(r.points),
                100.0 * r.area_kept,
                output::count(r.under_ancestor),
                100.0 * r.missing,
                100.0 * r.doubled
            )?;
        }
    }
    Ok(t)
}
