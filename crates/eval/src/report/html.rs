//! One page that needs no network: figures, plots and pictures.

use super::gallery::Exhibit;
use super::plot::{Axis, plot};
use super::{count, knob, short};
use crate::error::EvalError;
use crate::evaluation::Evaluation;
use crate::ratio::Metric;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use std::fmt::Write;

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:1180px;margin:2em auto;\
padding:0 1em;color:#222}h2{margin-top:2em}table{border-collapse:collapse;margin:1em 0}\
td,th{padding:.2em .7em;border-bottom:1px solid #ddd;text-align:right;white-space:nowrap}\
td:first-child,th:first-child{text-align:left}code{background:#f3f3f3;padding:.1em .3em}\
.plots svg{max-width:100%;height:auto}.plots{display:grid;gap:1em;\
grid-template-columns:repeat(auto-fit,minmax(430px,1fr))}figure{margin:1.5em 0}\
figure img{width:24%;image-rendering:pixelated;background:#bcbcbc}dt{font-weight:600}";

/// The page. Pictures are embedded; nothing is loaded from anywhere.
///
/// # Errors
/// When a plot cannot be made: a bug.
pub fn html(e: &Evaluation, exhibits: &[Exhibit]) -> Result<String, EvalError> {
    let mut page = String::new();
    body(&mut page, e, exhibits)?;
    Ok(page)
}

fn body(t: &mut String, e: &Evaluation, exhibits: &[Exhibit]) -> Result<(), EvalError> {
    let s = &e.subject;
    let title = format!("{} against its source", escape(&s.pack));
    put(
        t,
        &format!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title>\
         <style>{STYLE}</style></head><body>\n<h1>{title}</h1>\n"
        ),
    );
    put(
        t,
        &format!(
            "<p>{} points of {} triangles ({}), {} bytes, areas {}. {} views that no bake knows, parallel \
         cameras, {} light, {} samples a pixel at {} pixels and more below, errors over the box of \
         both pictures, on linear grey {}.</p>\n<p>{}, {} threads, drawn by {}; {} s. Made by \
         <code>{}</code> ({}).</p>\n",
            count(s.points as f64),
            count(s.triangles as f64),
            escape(&s.source.join(", ")),
            count(s.pack_bytes as f64),
            if s.calibrated { "calibrated" } else { "not calibrated" },
            e.views.len(),
            s.light,
            s.samples,
            s.heights.first().copied().unwrap_or(0),
            s.background,
            escape(&s.machine),
            s.threads,
            escape(&s.renderer),
            short(s.seconds),
            escape(&s.command),
            escape(&s.generator),
        ),
    );
    put(t, "<h2>What is compared</h2>\n<dl>\n");
    for c in &e.contenders {
        put(t, &format!("<dt>{}</dt><dd>{}</dd>\n", escape(&c.name), escape(&c.what)));
    }
    put(t, "</dl>\n");
    ratio_table(t, e);
    put(t, "<h2>Error against cost</h2>\n<div class=\"plots\">\n");
    for &height in &s.heights {
        for (metric, axis) in [
            (Metric::Flip, Axis::Primitives),
            (Metric::Rmse, Axis::Primitives),
            (Metric::Flip, Axis::Bytes),
            (Metric::Flip, Axis::Milliseconds),
        ] {
            put(t, &plot(e, height, metric, axis)?);
        }
    }
    put(t, "</div>\n");
    pictures(t, exhibits);
    level_table(t, e);
    popping_table(t, e);
    put(t, "</body></html>\n");
    Ok(())
}

/// Writing to a string cannot fail.
fn put(t: &mut String, text: &str) {
    let _ = t.write_str(text);
}

fn row(t: &mut String, tag: &str, cells: &[String]) {
    put(t, "<tr>");
    for cell in cells {
        put(t, &format!("<{tag}>{cell}</{tag}>"));
    }
    put(t, "</tr>\n");
}

fn head(t: &mut String, title: &str, cells: &[&str]) {
    put(t, &format!("<h2>{title}</h2>\n<table>\n"));
    row(t, "th", &cells.iter().map(|c| (*c).to_string()).collect::<Vec<_>>());
}

fn ratio_table(t: &mut String, e: &Evaluation) {
    let heights: Vec<String> = e.subject.heights.iter().map(|h| format!("{h} px")).collect();
    for metric in Metric::ALL {
        let title = format!("Primitives of other ways at the pack's {}", name(metric));
        let mut cells = vec!["median over views (least – most)"];
        cells.extend(heights.iter().map(String::as_str));
        head(t, &title, &cells);
        for c in e.contenders.iter().filter(|c| c.name != "pack") {
            let mut cells = vec![escape(&c.name)];
            for &h in &e.subject.heights {
                cells.push(e.ratio("pack", &c.name, metric, h).map_or("–".into(), |r| {
                    format!("<b>{} ×</b> ({} – {})", short(r.median), short(r.least), short(r.most))
                }));
            }
            row(t, "td", &cells);
        }
        put(t, "</table>\n");
    }
}

fn name(metric: Metric) -> &'static str {
    match metric {
        Metric::Flip => "FLIP",
        Metric::Rmse => "RMSE",
    }
}

fn pictures(t: &mut String, exhibits: &[Exhibit]) {
    if exhibits.is_empty() {
        return;
    }
    put(t, "<h2>Pictures</h2>\n<p>Source, level, difference × 2, FLIP.</p>\n");
    for x in exhibits {
        put(
            t,
            &format!(
                "<figure><figcaption><b>{}</b>, {}: {} primitives, FLIP {}, RMSE {}</figcaption>\n",
                escape(&x.contender),
                knob(x.knob),
                count(x.primitives),
                short(x.errors.flip),
                short(x.errors.rmse)
            ),
        );
        for (png, what) in x.pictures.iter().zip(["source", "level", "difference", "FLIP"]) {
            let data = STANDARD.encode(png);
            put(t, &format!("<img alt=\"{what}\" src=\"data:image/png;base64,{data}\">\n"));
        }
        put(t, "</figure>\n");
    }
}

fn level_table(t: &mut String, e: &Evaluation) {
    head(
        t,
        "All levels, means over views",
        &[
            "way",
            "height",
            "setting",
            "primitives",
            "bytes",
            "select, µs",
            "picture, ms",
            "FLIP",
            "FLIP worst",
            "RMSE",
            "PSNR",
            "SSIM",
            "coverage",
            "IoU",
            "depth",
        ],
    );
    for x in e.summaries() {
        let (c, r) = (&x.errors, x.row);
        let some = |v: Option<f64>| v.map_or("–".into(), short);
        row(
            t,
            "td",
            &[
                escape(&r.contender),
                r.height.to_string(),
                knob(r.knob),
                count(x.primitives),
                count(x.bytes),
                some(r.cost.select_ns.map(|v| v / 1e3)),
                some(r.cost.render_ms),
                short(c.flip),
                short(x.worst[0]),
                short(c.rmse),
                some(c.psnr),
                short(c.ssim),
                c.coverage_ratio.map_or("–".into(), |v| format!("{:+.1} %", 100.0 * v)),
                short(c.silhouette_iou),
                some(c.depth),
            ],
        );
    }
    put(t, "</table>\n");
}

fn popping_table(t: &mut String, e: &Evaluation) {
    let Some(first) = e.popping.first() else { return };
    let title = format!(
        "Change from step to step, {} pixels high (the truth's own as the camera moves: {}, and as it turns: {})",
        first.height,
        short(first.truth),
        short(first.turning_truth)
    );
    let cells = [
        "way",
        "setting",
        "level switches, camera still",
        "worst",
        "camera moves: what the truth does not do",
        "worst",
        "the same with one cut",
        "camera turns: what the truth does not do",
        "worst",
    ];
    head(t, &title, &cells);
    for p in &e.popping {
        let cells = [
            escape(&p.contender),
            knob(p.knob),
            short(p.still),
            short(p.still_worst),
            short(p.moving),
            short(p.moving_worst),
            p.moving_fixed.map_or("–".into(), short),
            short(p.turning),
            short(p.turning_worst),
        ];
        row(t, "td", &cells);
    }
    put(t, "</table>\n");
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
