//! What each factor of the light on leaves buys, beside ray-cast truth: writes docs/LIGHT.md.
//!
//! Candussi, Candussi, Höllerer 2005 light leaves by a sum of four factors: vertex light by normals that
//! point away from the middle of the crown's box, a density factor, a shadow-map test, and an occlusion
//! factor by the depth of the occluder. Here the sum has weights that are fitted to the truth, on half
//! of the suns, and judged on the others.

mod density;
mod factors;
mod fit;

use anyhow::{Context, Result};
use factors::{FACTORS, Samples};
use fit::{Fit, PRODUCT};
use forest_tests::report_trees;
use std::fmt::Write;
use std::path::Path;

const SAMPLES: [&str; 3] = ["broadleaf_young.gltf", "conifer.glb", "shrub.obj"];
const SHARED: [&str; 4] =
    ["sap_pine_20k.glb", "ez_oak_dense_200k.glb", "sap_birch_200k.glb", "sap_jmaple_450k.glb"];

fn main() -> Result<()> {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let mut text = String::from(NOTES);
    let mut all: Vec<(String, Samples)> = Vec::new();
    for path in report_trees(&SAMPLES, &SHARED) {
        let name = path.file_name().context("a name")?.to_string_lossy().into_owned();
        if wanted.is_empty() || wanted.contains(&name) {
            eprintln!("{name}");
            let samples = Samples::of(&path)?;
            if samples.rows.iter().all(Vec::is_empty) {
                writeln!(text, "{name} is left out: its leaves cover no block of pixels.\n")?;
            } else {
                all.push((name, samples));
            }
        }
    }
    for (name, samples) in &all {
        table(&mut text, name, samples)?;
    }
    weights(&mut text, &all)?;
    if wanted.is_empty() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/LIGHT.md");
        std::fs::write(&path, &text).with_context(|| path.display().to_string())?;
    }
    print!("{text}");
    Ok(())
}

const NOTES: &str = "# Light on leaves: what each factor buys

Written by `make light`. Truth: sunlight alone on leaves that shine through, by rays with shadows, divided by the base colour;
16 suns, three views, trees of 128 pixels; means over blocks of 8 × 8 pixels that leaves cover. Factors are taken on the foliage's finest
level: *vertex* is the cosine of the sun to a normal that points away from the middle of the crown's box, *density* the share of light
that comes through the leaves around, *shadow* the test of a shadow map of the foliage, *occlusion* a fade by the depth behind what
it shows, *through* what comes through the pack's grid of the tree's density (at most 34 cells a side), by which points, views and
volumes are lit, *hotspot* the closed form of leaves that face all ways, seen and lit from two directions (`forest_raster::scattered`).
Weights of sums are fitted by least squares on every second sun and judged on the others; in *products* the sum is multiplied by
the hotspot's factor. RMSE is over the mean of the truth. *Alone*: this factor and a constant; *without*: all others. *Worst sun*: the
largest error of the mean light under one sun.

";

/// Sets of factors: a name, and which.
fn sets() -> Vec<(String, Vec<usize>)> {
    let all: Vec<usize> = (0..FACTORS.len()).collect();
    let mut out = vec![("constant".to_string(), vec![])];
    for i in &all {
        out.push((format!("{} alone", FACTORS[*i]), vec![*i]));
    }
    out.push(("the paper's four".into(), vec![0, 1, 2, 3]));
    for i in &all {
        out.push((
            format!("all without {}", FACTORS[*i]),
            all.iter().copied().filter(|j| j != i).collect(),
        ));
    }
    out.push(("all".into(), all));
    out.push(("hotspot × constant".into(), vec![PRODUCT]));
    for (i, name) in FACTORS[..FACTORS.len() - 1].iter().enumerate() {
        out.push((format!("hotspot × {name}"), vec![i, PRODUCT]));
    }
    out.push(("hotspot × (vertex, density)".into(), vec![0, 1, PRODUCT]));
    out.push(("hotspot × (density, occlusion)".into(), vec![1, 3, PRODUCT]));
    out.push(("hotspot × (vertex, density, occlusion)".into(), vec![0, 1, 3, PRODUCT]));
    out.push(("hotspot × the paper's four".into(), vec![0, 1, 2, 3, PRODUCT]));
    out
}

fn table(text: &mut String, name: &str, samples: &Samples) -> Result<()> {
    writeln!(text, "## {name}\n\n| factors | RMSE | worst sun |\n|---|---:|---:|")?;
    for (what, which) in sets() {
        let fit = Fit::of(samples, &which);
        let [rmse, worst] = fit.errors(samples);
        writeln!(text, "| {what} | {rmse:.3} | {:+.1} % |", 100.0 * worst)?;
    }
    writeln!(text)?;
    Ok(())
}

fn weights(text: &mut String, all: &[(String, Samples)]) -> Result<()> {
    writeln!(text, "## Weights\n\nOf all factors, by tree: constant, {}.\n", FACTORS.join(", "))?;
    writeln!(
        text,
        "| tree | {} |",
        ["constant"].iter().chain(&FACTORS).copied().collect::<Vec<_>>().join(" | ")
    )?;
    writeln!(text, "|---|{}", "---:|".repeat(FACTORS.len() + 1))?;
    let which: Vec<usize> = (0..FACTORS.len()).collect();
    for (name, samples) in all {
        let fit = Fit::of(samples, &which);
        let numbers: Vec<String> = fit.weights().iter().map(|w| format!("{w:+.3}")).collect();
        writeln!(text, "| {name} | {} |", numbers.join(" | "))?;
    }
    writeln!(
        text,
        "\nOf hotspot × shadow without a constant, so that the mean light on these blocks is that of the truth. The bake \
         fits it\nto whole pictures, tree by tree and level by level, and so it does the weight of the sky:\n"
    )?;
    for (name, samples) in all {
        let rows = || samples.rows.iter().flatten();
        let truth: f64 = rows().map(|r| r[FACTORS.len()]).sum();
        let product: f64 = rows().map(|r| r[2] * r[FACTORS.len() - 1]).sum();
        let own = samples.sunlit;
        writeln!(text, "- {name}: {:.3}; the bake's {own:.3}", truth / product)?;
    }
    Ok(())
}
