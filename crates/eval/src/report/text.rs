//! The table on a terminal.

use super::{count, knob, short};
use crate::evaluation::Evaluation;
use std::fmt::{Error, Write};

/// What the pack costs and how far it is from its source, by height and threshold, and how many
/// primitives other ways need for the same error.
///
/// # Errors
/// Never: strings take all text.
pub fn text(e: &Evaluation) -> Result<String, Error> {
    let mut t = String::new();
    let s = &e.subject;
    writeln!(
        t,
        "{}: {} points of {} triangles, {}; {} views, {} samples",
        s.pack,
        count(s.points as f64),
        count(s.triangles as f64),
        if s.calibrated { "calibrated" } else { "not calibrated" },
        e.views.len(),
        s.samples
    )?;
    writeln!(
        t,
        "\n{:>6}  {:<16} {:>11} {:>9} {:>7} {:>7} {:>6} {:>9} {:>6} {:>8} {:>9}",
        "height",
        "level",
        "primitives",
        "kB",
        "FLIP",
        "RMSE",
        "SSIM",
        "coverage",
        "IoU",
        "depth",
        "render"
    )?;
    for x in e.summaries().iter().filter(|x| x.row.contender == "pack") {
        let c = &x.errors;
        writeln!(
            t,
            "{:>6}  {:<16} {:>11} {:>9} {:>7} {:>7} {:>6.3} {:>8.1}% {:>6.3} {:>8} {:>6} ms",
            x.row.height,
            knob(x.row.knob),
            count(x.primitives),
            count(x.bytes / 1000.0),
            short(c.flip),
            short(c.rmse),
            c.ssim,
            100.0 * c.coverage_ratio.unwrap_or(0.0),
            c.silhouette_iou,
            c.depth.map_or("-".into(), short),
            x.row.cost.render_ms.map_or("-".into(), short),
        )?;
    }
    if !e.ratios.is_empty() {
        writeln!(
            t,
            "\nprimitives of other ways for the pack's error: median over views (least – most)"
        )?;
        writeln!(t, "{:<11} {:>5} {:>7} {:>9}", "", "", "height", "ratio")?;
        for r in e.ratios.iter().filter(|r| r.base == "pack") {
            writeln!(
                t,
                "{:<11} {:>5} {:>7} {:>9} ({} – {})",
                r.other,
                format!("{:?}", r.metric).to_uppercase(),
                r.height,
                short(r.median),
                short(r.least),
                short(r.most)
            )?;
        }
    }
    if !e.popping.is_empty() {
        writeln!(
            t,
            "\nchange of the picture, RMSE: as the level follows a step of 1 % with the camera still \
             (a mesh: one switch of level);\nas the camera takes the step, what the truth (changing by {}) \
             does not do, and with one cut for all steps",
            e.popping.first().map_or("0".into(), |p| short(p.truth))
        )?;
        for p in &e.popping {
            writeln!(
                t,
                "{:<11} {:<18} {:>8} (worst {}); {:>7} (worst {}, one cut {})",
                p.contender,
                knob(p.knob),
                short(p.still),
                short(p.still_worst),
                short(p.moving),
                short(p.moving_worst),
                p.moving_fixed.map_or("-".into(), short)
            )?;
        }
    }
    Ok(t)
}
