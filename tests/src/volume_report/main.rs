//! `make volume`: what volumes hold, cost and lose, beside the paper's figures; writes
//! docs/VOLUME.md, docs/volume.svg and docs/volume_heldout.png.

mod capture;
mod study;

use anyhow::{Context, Result};
use forest_eval::{Evaluation, Knob, Summary};
use forest_tests::report_trees;
use forest_tests::reports::{load_soup, name_of, program};
use std::fmt::Write;
use std::path::Path;

const SHARED: [&str; 3] = ["ez_oak_dense_200k.glb", "sap_birch_200k.glb", "sap_pine_20k.glb"];
/// The tree whose plot is committed.
const PLOTTED: &str = "broadleaf_young.gltf";
/// The tree that is photographed; without ../shared the plotted one.
const PHOTOGRAPHED: &str = "sap_birch_200k.glb";

fn main() -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let out = root.join("out/volume");
    std::fs::create_dir_all(&out)?;
    let trees = report_trees(&[PLOTTED], &SHARED);
    // The sample tree stands for them where they are not there.
    let studied = if trees.len() > 1 { &trees[1..] } else { &trees };
    let mut text = String::from(HEAD);
    let mut studies = Vec::new();
    for tree in studied {
        let name = name_of(tree);
        eprintln!("{name}");
        studies.push((name, study::of(&load_soup(tree)?)?));
    }
    study::write(&mut text, &studies)?;
    let named = |name: &str| trees.iter().find(|t| name_of(t) == name);
    let photographed = named(PHOTOGRAPHED).or(named(PLOTTED)).context("a tree to photograph")?;
    eprintln!("photographs of {}", name_of(photographed));
    let picture = root.join("docs/volume_heldout.png");
    capture::write(&mut text, &name_of(photographed), &load_soup(photographed)?, &picture)?;
    let plotted = named(PLOTTED).context("the plotted tree")?;
    beside_others(&mut text, &evaluated(plotted, &out, &root.join("docs/volume.svg"))?)?;
    std::fs::write(root.join("docs/VOLUME.md"), text)?;
    println!("{}", root.join("docs/VOLUME.md").display());
    Ok(())
}

const HEAD: &str = "# Volumes: what they hold, cost and lose

Written by `make volume`, beside the figures of paper 004 (Linz, Reche-Martinez, Drettakis, Magnor
2006), whose trees – a dense oak, a pine, a sparse small oak, all from photographs – are not ours: its
figures show what the method gave there. Default bakes: 16 cameras on the half sphere, an octree of 7
levels below the root, 4 × 4 texels, codebooks of 512. Errors are means over four held-out views,
parallel, 16 samples a pixel, base colours, over linear grey 0.5; RMSE is of premultiplied linear RGBA
over the box of both pictures. Times are of one run on the machine named in BENCH.md.
";

/// Points, views and a volume of a tree in one pack, evaluated.
fn evaluated(tree: &Path, out: &Path, svg: &Path) -> Result<Evaluation> {
    let pack = out.join("all.fpack");
    let [tree, pack, svg] = [tree, &pack, svg].map(|p| p.to_string_lossy().into_owned());
    program(&["points", &tree, "-o", &pack, "--force", "--measure"])?;
    program(&["views", &tree, "-o", &pack])?;
    program(&["volume", &tree, "-o", &pack])?;
    let json = program(&["eval", &pack, "--source", &tree, "--alone", "--json", "--svg", &svg])?;
    Ok(serde_json::from_slice(&json)?)
}

fn beside_others(t: &mut String, e: &Evaluation) -> Result<()> {
    let name = e.subject.source.first().map_or("", String::as_str);
    writeln!(
        t,
        "\n## Beside points and views: {name}\n\n![FLIP against primitives](volume.svg)\n\n\
         At 64 pixels; primitives are points and triangles, views, or billboards, and kB those that a \
         renderer looks at (of a volume with the whole atlas).\n\n\
         | way | level | primitives | kB | FLIP | RMSE | coverage |\n|---|---|---|---|---|---|---|"
    )?;
    let level = |s: &Summary| match s.row.knob {
        Knob::Points { s_m, .. } => format!("s_m {s_m} px²"),
        Knob::Views { texels, .. } => format!("{texels}² texels"),
        Knob::Volume { level } | Knob::Foliage { level } => format!("level {level}"),
        Knob::Share(share) => format!("{share}"),
    };
    for s in e.summaries().iter().filter(|s| s.row.height == 64) {
        writeln!(
            t,
            "| {} | {} | {:.0} | {:.1} | {:.4} | {:.4} | {:+.1} % |",
            s.row.contender,
            level(s),
            s.primitives,
            s.bytes / 1000.0,
            s.errors.flip,
            s.errors.rmse,
            100.0 * s.errors.coverage_ratio.unwrap_or(0.0),
        )?;
    }
    writeln!(
        t,
        "\nPopping at 96 pixels: RMSE from picture to picture beyond what the truth changes, as the camera \
         moves away by 1 % a step, and around by 1°; the truth changes by {:.3} and {:.3}.\n\n\
         | way | moving | worst step | turning | worst step |\n|---|---|---|---|---|",
        e.popping.first().map_or(f64::NAN, |p| p.truth),
        e.popping.first().map_or(f64::NAN, |p| p.turning_truth),
    )?;
    for p in &e.popping {
        writeln!(
            t,
            "| {} | {:.4} | {:.4} | {:.4} | {:.4} |",
            p.contender, p.moving, p.moving_worst, p.turning, p.turning_worst
        )?;
    }
    Ok(())
}
