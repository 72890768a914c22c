//! `make views`: what views cost and how far they are from the truth, by number of views, layout,
//! look-up and storage; writes docs/VIEWS.md and docs/views.svg.

mod study;

use anyhow::{Context, Result};
use forest_eval::{Evaluation, Summary};
use forest_tests::report_trees;
use forest_tests::reports::{load_soup, name_of, program};
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;

const TREES: [&str; 2] = ["conifer.glb", "broadleaf_young.gltf"];
const SHARED: [&str; 2] = ["sap_birch_200k.glb", "ez_oak_dense_200k.glb"];
/// The tree whose plot is committed.
const PLOTTED: &str = "broadleaf_young.gltf";

fn main() -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let out = root.join("out/views");
    std::fs::create_dir_all(&out)?;
    let trees = report_trees(&TREES, &SHARED);
    let mut text = String::from(HEAD);
    let mut bakes = Vec::new();
    let mut studies = Vec::new();
    for tree in &trees {
        let name = name_of(tree);
        eprintln!("{name}");
        bakes.push((name.clone(), baked(tree, &out)?));
        studies.push((name, study::of(&load_soup(tree)?)?));
    }
    bake_table(&mut text, &bakes)?;
    study::write(&mut text, &studies)?;
    let plotted = trees.iter().find(|t| name_of(t) == PLOTTED).context("the plotted tree")?;
    beside_points(&mut text, &evaluated(plotted, &out, &root.join("docs/views.svg"))?)?;
    std::fs::write(root.join("docs/VIEWS.md"), text)?;
    println!("{}", root.join("docs/VIEWS.md").display());
    Ok(())
}

const HEAD: &str = "# Views: cost and error

Written by `make views`. Errors are means over four held-out views (sin of the elevation evenly from
−0.1 to 1), parallel, 64 samples a pixel at 256 pixels, base colours, over linear grey 0.5; RMSE is of
premultiplied linear RGBA over the box of both pictures. Times are those of one run on the machine
named in BENCH.md; they are stated for their ratios.
";

/// What `views --json` says of a default bake of 300 views, and of the same with tiles of 32 texels
/// from triangles and from points.
fn baked(tree: &Path, out: &Path) -> Result<[Value; 3]> {
    let pack = out.join("t.fpack");
    let (tree, pack) = (tree.to_string_lossy(), pack.to_string_lossy());
    let run = |options: &[&str]| -> Result<Value> {
        let args = ["views", &*tree, "-o", &*pack, "--force", "--json", "-q"];
        Ok(serde_json::from_slice(&program(&[&args[..], options].concat())?)?)
    };
    Ok([
        run(&["--layout", "rings:13x23"])?,
        run(&["--texels", "32", "--detail", "triangles", "--channels", "color,normal,depth"])?,
        run(&["--texels", "32", "--detail", "points", "--channels", "color,normal,depth"])?,
    ])
}

fn bake_table(t: &mut String, bakes: &[(String, [Value; 3])]) -> Result<()> {
    writeln!(
        t,
        "\n## Bakes of 300 views of 256², 16 samples a texel, all channels\n\n\
         Of the texels of whole tiles, *stored* is kept and *seen* shows something; *sphere* is how many \
         times the area of tiles about the sphere of the tree's box would be.\n\n\
         | tree | triangles: capture s | sky s | encode s | MiB | stored | seen | page waste | sphere | \
         32² from triangles s | from points s |\n|---|---|---|---|---|---|---|---|---|---|---|"
    )?;
    for (name, [full, triangles, points]) in bakes {
        let n = |v: &Value, key: &str| v[key].as_f64().unwrap_or(f64::NAN);
        let small = |v: &Value| n(v, "capture_seconds") + n(v, "prepare_seconds");
        writeln!(
            t,
            "| {name} | {:.2} | {:.2} | {:.2} | {:.1} | {:.0} % | {:.0} % | {:.0} % | {:.2} | {:.2} | {:.2} |",
            n(full, "capture_seconds"),
            n(full, "sky_seconds"),
            n(full, "encode_seconds"),
            n(full, "view_bytes") / f64::from(1 << 20),
            100.0 * n(full, "stored_share"),
            100.0 * n(full, "seen_share"),
            100.0 * n(full, "page_waste"),
            n(full, "sphere_area"),
            small(triangles),
            small(points),
        )?;
    }
    Ok(())
}

/// Bakes points and default views into one pack and evaluates both.
fn evaluated(tree: &Path, out: &Path, svg: &Path) -> Result<Evaluation> {
    let pack = out.join("both.fpack");
    let [tree, pack, svg] = [tree, &pack, svg].map(|p| p.to_string_lossy().into_owned());
    program(&["points", &tree, "-o", &pack, "--force", "--measure"])?;
    program(&["views", &tree, "-o", &pack])?;
    let json = program(&["eval", &pack, "--source", &tree, "--alone", "--json", "--svg", &svg])?;
    Ok(serde_json::from_slice(&json)?)
}

fn beside_points(t: &mut String, e: &Evaluation) -> Result<()> {
    let name = e.subject.source.first().map_or("", String::as_str);
    writeln!(
        t,
        "\n## Views beside points: {name}\n\n![FLIP against primitives](views.svg)\n\n\
         The cheapest rows of each way at 64 pixels; kB are those that a renderer looks at.\n\n\
         | way | level | primitives | kB | FLIP | RMSE | coverage |\n|---|---|---|---|---|---|---|"
    )?;
    let level = |s: &Summary| match s.row.knob {
        forest_eval::Knob::Points { s_m, .. } => format!("s_m {s_m} px²"),
        forest_eval::Knob::Views { texels, .. } => format!("{texels}² texels"),
        forest_eval::Knob::Volume { level } | forest_eval::Knob::Foliage { level } => {
            format!("level {level}")
        }
        forest_eval::Knob::Share(share) => format!("{share}"),
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
    writeln!(t, "\nAs the camera turns by 1° steps, the change that the truth does not make:\n")?;
    for p in &e.popping {
        writeln!(
            t,
            "* {}: {:.4}, at most {:.4} (the truth changes by {:.4})",
            p.contender, p.turning, p.turning_worst, p.turning_truth
        )?;
    }
    Ok(())
}
