//! The table on a terminal.

use super::{count, knob, short};
use crate::evaluation::{Evaluation, Summary};
use std::fmt::{Error, Write};

/// What the pack costs and how far it is from its source, by height and threshold, and how many
/// primitives other ways need for the same error.
///
/// # Errors
/// Never: strings take all text.
pub fn text(e: &Evaluation) -> Result<String, Error> {
    let mut t = String::new();
    let s = &e.subject;
    let own = |x: &Summary| crate::embed::is_own(&x.row.contender);
    writeln!(
        t,
        "{}: {} points of {} triangles, {}; {} light, {} views, {} samples",
        s.pack,
        count(s.points as f64),
        count(s.triangles as f64),
        if s.calibrated { "calibrated" } else { "not calibrated" },
        s.light,
        e.views.len(),
        s.samples
    )?;
    if s.light == "sun" {
        writeln!(t, "the source throws shadows, the levels do not: most of the errors is that")?;
    }
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
    for x in e.summaries().iter().filter(|x| own(x)) {
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
            "\npopping: RMSE from picture to picture as the camera moves away by 1 %; the truth changes by {}\n\
             still: only the level follows, the camera stands (a mesh: one switch of level)\n\
             moving: what changes and the truth does not; one cut: the same without switches of level\n\
             turning: the same as the camera goes around by 1°; the truth changes by {}",
            e.popping.first().map_or("0".into(), |p| short(p.truth)),
            e.popping.first().map_or("0".into(), |p| short(p.turning_truth))
        )?;
        for p in &e.popping {
            writeln!(
                t,
                "{:<11} {:<22} still {:>6} (worst {}), moving {:>6} (worst {}), one cut {}, turning {} (worst {})",
                p.contender,
                knob(p.knob),
                short(p.still),
                short(p.still_worst),
                short(p.moving),
                short(p.moving_worst),
                p.moving_fixed.map_or("-".into(), short),
                short(p.turning),
                short(p.turning_worst)
            )?;
        }
    }
    Ok(t)
}
