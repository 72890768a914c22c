//! `make report`: evaluates the sample trees, and those of ../shared/trees where they are, with the
//! shipped program; writes docs/REPORT.md, docs/pareto.svg and the README's figures.

use anyhow::{Context, Result, bail};
use forest_eval::{Evaluation, Metric, Summary};
use forest_import::{Block, Limits};
use forest_raster::{Light, RayScene, Style, Surfaces, rasterize};
use forest_tests::reference::{REFERENCES, VIEWS, against, reference};
use forest_tests::report_trees;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;

const TREES: [&str; 3] = ["conifer.glb", "broadleaf_young.gltf", "shrub.obj"];
const SHARED: [&str; 8] = [
    "sap_pine_20k.glb",
    "ez_ash_medium.glb",
    "christmas_tree/christmas_tree.obj",
    "bush/bush.obj",
    "japaneseMaple/japaneseMaple.obj",
    "sap_birch_200k.glb",
    "ez_oak_dense_200k.glb",
    "sap_jmaple_450k.glb",
];
/// The tree whose plot the README shows.
const PLOTTED: &str = "broadleaf_young.gltf";
/// Other ways, with what the ratio to the pack says.
const WAYS: [(&str, &str, &str); 11] = [
    (
        "pack",
        "clustering",
        "uniform clustering of the whole block, opaque points (Pauly et al. 2002)",
    ),
    ("raw", "clustering", "the same, against the pack without calibration"),
    ("pack", "bias-1/4", "the paper's depth bias, k = s_m/4: below 1 it gains"),
    ("pack", "bias-1", "the paper's depth bias, k = s_m: below 1 it gains"),
    ("pack", "raw", "no calibration"),
    ("raw", "area", "hidden leaves counted as if they were seen (both without calibration)"),
    ("raw", "opaque", "the same, and no opacity"),
    ("pack", "paper", "radius, order and bias of Gilet, Meyer, Neyret 2005"),
    ("pack", "random", "random points (Cook et al. 2007)"),
    ("pack", "simplify", "triangles by meshoptimizer"),
    ("raw", "simplify", "the same, against the pack without calibration"),
];
const BEGIN: &str = "<!-- figures of `make report` -->";
const END: &str = "<!-- end of figures -->";

fn main() -> Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let out = root.join("out/report");
    std::fs::create_dir_all(&out)?;
    let trees = report_trees(&TREES, &SHARED);
    let mut found = Vec::new();
    for tree in &trees {
        found.push(evaluate(tree, &out)?);
    }
    std::fs::copy(out.join(PLOTTED).with_extension("svg"), root.join("docs/pareto.svg"))?;
    std::fs::write(root.join("docs/REPORT.md"), report(&found)?)?;
    let readme = root.join("README.md");
    let text = std::fs::read_to_string(&readme)?;
    let (before, rest) = text.split_once(BEGIN).context("README.md has no figures")?;
    let (_, after) = rest.split_once(END).context("README.md: the figures have no end")?;
    std::fs::write(&readme, format!("{before}{BEGIN}\n{}{END}{after}", headline(&found)?))?;
    println!("{}", out.display());
    Ok(())
}

/// Bakes, measures and evaluates one tree by the program beside this one.
fn evaluate(tree: &Path, out: &Path) -> Result<Evaluation> {
    let name = tree.file_name().context("a file")?;
    eprintln!("{}", name.display());
    let at = |extension: &str| out.join(name).with_extension(extension);
    let pack = at("fpack");
    program(&[
        "points".as_ref(),
        tree,
        "-o".as_ref(),
        &pack,
        "--measure".as_ref(),
        "--force".as_ref(),
    ])?;
    let [html, csv, svg] = ["html", "csv", "svg"].map(at);
    let json = program(&[
        "eval".as_ref(),
        &pack,
        "--source".as_ref(),
        tree,
        "--json".as_ref(),
        "--html".as_ref(),
        &html,
        "--csv".as_ref(),
        &csv,
        "--svg".as_ref(),
        &svg,
    ])?;
    std::fs::write(at("json"), &json)?;
    Ok(serde_json::from_slice(&json)?)
}

/// Standard output of forest-bake.
fn program(args: &[&Path]) -> Result<Vec<u8>> {
    let forest_bake = std::env::current_exe()?.with_file_name("forest-bake");
    let output =
        Command::new(forest_bake).args(args).stderr(std::process::Stdio::inherit()).output()?;
    if !output.status.success() {
        bail!("forest-bake {args:?}: {}", output.status);
    }
    Ok(output.stdout)
}

fn tree(e: &Evaluation) -> &str {
    e.subject.source.first().map_or("", String::as_str)
}

fn report(found: &[Evaluation]) -> Result<String> {
    let mut t = String::from("# Error against cost\n\nWritten by `make report`");
    if let Some(e) = found.first() {
        let s = &e.subject;
        write!(
            t,
            ": {}, {} threads. {} views that neither bakes nor calibrations know, parallel cameras, base \
             colours, {} samples a pixel at {} pixels, errors over the box of both pictures on linear \
             grey {}. The pages with all plots, pictures and levels are in `out/report`.\n\n",
            s.machine,
            s.threads,
            e.views.len(),
            s.samples,
            s.heights[0],
            s.background
        )?;
    }
    writeln!(t, "## Primitives of other ways at the pack's error\n")?;
    writeln!(
        t,
        "How many times the points that the pack needs: the median over the views of the geometric mean \
         over all errors that both reach, least – most of a view in brackets; – where they share less than \
         a factor of 1.5 in error (mostly because the pack's coarsest level is better than the other's \
         finest). All but the pack are drawn without calibration: from 64 pixels down their error is \
         mostly that their crowns fatten or thin, and what the pack gains is mostly that its crowns do \
         not; the rows over `raw` tell how much is due to calibration. At 256 pixels the gain grows with \
         how much hides within a point. In crowns of textured cards (oak, ash) and sparse trees of the \
         sample data little does: clusters of opaque discs lose less there, and the aim of three times \
         fewer points is met from 64 pixels down only.\n"
    )?;
    for (base, way, what) in WAYS {
        ratio_table(&mut t, found, base, way, what)?;
    }
    truth_table(&mut t)?;
    writeln!(t, "## Levels of the packs\n")?;
    writeln!(
        t,
        "Means over the views at s_m = 2 px², and the seconds that the evaluation took.\n"
    )?;
    level_table(&mut t, found)?;
    writeln!(t, "\n## Switches of level\n")?;
    writeln!(
        t,
        "RMSE between two pictures as the level follows a camera's step of 1 % while the camera stands \
         still (popping alone; for the mesh one switch from 20 % to 10 %), the change of the truth as the \
         camera takes the step, and what the pack changes then and the truth does not: with its switches \
         of level, and with one cut. {} pixels high.\n",
        found.first().and_then(|e| e.popping.first()).map_or(0, |p| p.height)
    )?;
    popping_table(&mut t, found)?;
    Ok(t)
}

/// The ground truth beside an independent renderer's pictures, where they are.
fn truth_table(t: &mut String) -> Result<()> {
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared");
    let references = shared.join("reference");
    if !references.exists() {
        return Ok(());
    }
    writeln!(
        t,
        "## The truth beside Cycles\n\nCoverage, mean colour and RMSE (after a 4×4 box filter: their 32 \
         samples are noisy) over the box of the tree, the worst of four views. Lit by a sun and a sky, \
         theirs has bounces between leaves and highlights that ours leaves out, and is brighter the denser \
         the crown. Their maple is darker, and by view: as if the twin it was rendered from had kept \
         glTF's metallic default.\n\n\
         | tree | coverage | colour | RMSE | our light over theirs, least – most | RMSE, lit |\n\
         |---|---|---|---|---|---|"
    )?;
    for (name, file) in REFERENCES {
        let path = shared.join("trees").join(file).to_string_lossy().into_owned();
        let soup = Block::parse(&[path])?.load(&Limits::default())?.model.flatten(10_000_000)?;
        let surfaces = Surfaces::new(&soup.materials, &soup.textures);
        let scene = RayScene::new(&soup, &surfaces);
        let (mut worst, mut lit_rmse) = ([0.0f64; 3], 0.0f64);
        let (mut least, mut most) = (f64::INFINITY, 0.0f64);
        for view in VIEWS {
            let r = reference(&references.join(name), view, "albedo");
            let ours = rasterize(&soup, &surfaces, &r.camera, &Style::default());
            for (worst, v) in worst.iter_mut().zip(against(&r.pixels, &ours)) {
                *worst = worst.max(v.abs());
            }
            let r = reference(&references.join(name), view, "lit");
            let ours =
                scene.picture(&r.camera, &Style { light: Light::Sun(r.sun), ..Style::default() });
            let light =
                |p: &[[f32; 4]]| -> f64 { p.iter().map(|v| f64::from(v[0] + v[1] + v[2])).sum() };
            let ratio = light(&ours.pixels) / light(&r.pixels);
            (least, most) = (least.min(ratio), most.max(ratio));
            lit_rmse = lit_rmse.max(against(&r.pixels, &ours)[2]);
        }
        let [coverage, colour, rmse] = worst;
        writeln!(
            t,
            "| {name} | {coverage:.4} | {colour:.4} | {rmse:.4} | {least:.2} – {most:.2} | {lit_rmse:.4} |"
        )?;
    }
    writeln!(t)?;
    Ok(())
}

fn heights(found: &[Evaluation]) -> Vec<u32> {
    found.first().map_or(vec![], |e| e.subject.heights.clone())
}

fn ratio_table(
    t: &mut String,
    found: &[Evaluation],
    base: &str,
    way: &str,
    what: &str,
) -> Result<()> {
    writeln!(t, "### {way} over {base}: {what}\n")?;
    let columns: Vec<(Metric, u32)> = Metric::ALL
        .into_iter()
        .flat_map(|m| heights(found).into_iter().map(move |h| (m, h)))
        .filter(|(m, h)| found.iter().any(|e| e.ratio(base, way, *m, *h).is_some()))
        .collect();
    let names: Vec<String> = columns
        .iter()
        .map(|(m, h)| format!("{}, {h} px", format!("{m:?}").to_uppercase()))
        .collect();
    writeln!(t, "| tree | {} |\n|---|{}", names.join(" | "), "---|".repeat(names.len()))?;
    for e in found {
        let cells: Vec<String> = columns
            .iter()
            .map(|(m, h)| {
                e.ratio(base, way, *m, *h).map_or("–".into(), |r| {
                    format!("**{}** ({} – {})", digits(r.median), digits(r.least), digits(r.most))
                })
            })
            .collect();
        writeln!(t, "| {} | {} |", tree(e), cells.join(" | "))?;
    }
    writeln!(t)?;
    Ok(())
}

fn level_table(t: &mut String, found: &[Evaluation]) -> Result<()> {
    writeln!(
        t,
        "| tree | triangles | points, all levels | height | primitives | FLIP | RMSE | SSIM | coverage | \
         coverage uncalibrated | select | evaluation |\n|---|---|---|---|---|---|---|---|---|---|---|---|"
    )?;
    for e in found {
        let all = e.summaries();
        let at = |name: &str, height: u32| -> Option<&Summary> {
            let one = |s: &&Summary| s.row.contender == name && s.row.height == height;
            all.iter()
                .filter(one)
                .find(|s| s.row.knob.thresholds().is_some_and(|t| (t.finest.0 - 2.0).abs() < 1e-9))
        };
        let percent = |s: Option<&Summary>| {
            let value = s.and_then(|s| s.errors.coverage_ratio);
            value.map_or("–".into(), |v| format!("{:+.1} %", 100.0 * v))
        };
        for height in &e.subject.heights {
            let Some(s) = at("pack", *height) else { continue };
            let x = &s.errors;
            writeln!(
                t,
                "| {} | {} | {} | {height} px | {:.0} | {:.3} | {:.3} | {:.3} | {} | {} | {:.1} µs | \
                 {:.0} s |",
                tree(e),
                e.subject.triangles,
                e.subject.points,
                s.primitives,
                x.flip,
                x.rmse,
                x.ssim,
                percent(Some(s)),
                percent(at("raw", *height)),
                s.row.cost.select_ns.unwrap_or(0.0) / 1e3,
                e.subject.seconds
            )?;
        }
    }
    Ok(())
}

fn popping_table(t: &mut String, found: &[Evaluation]) -> Result<()> {
    writeln!(
        t,
        "| tree | pack, still | mesh, still | truth, moving | pack, moving | one cut, moving |\n\
         |---|---|---|---|---|---|"
    )?;
    for e in found {
        let of = |name: &str| e.popping.iter().find(|p| p.contender == name);
        let (Some(pack), Some(mesh)) = (of("pack"), of("simplify")) else { continue };
        writeln!(
            t,
            "| {} | {:.4} (worst {:.4}) | {:.4} | {:.4} | {:.4} | {} |",
            tree(e),
            pack.still,
            pack.still_worst,
            mesh.still,
            pack.truth,
            pack.moving,
            pack.moving_fixed.map_or("–".into(), |v| format!("{v:.4}"))
        )?;
    }
    Ok(())
}

/// The README's table: what the pack saves beside uniform clustering.
fn headline(found: &[Evaluation]) -> Result<String> {
    let mut t = String::from(
        "\n| tree | triangles | 256 px, equal FLIP | 256 px, equal RMSE | 64 px, equal FLIP | 64 px, equal \
         RMSE | coverage, worst of all levels of 1,000 points and more |\n|---|---|---|---|---|---|---|\n",
    );
    for e in found {
        let cell = |metric, height| {
            e.ratio("pack", "clustering", metric, height)
                .map_or("–".into(), |r| format!("{} ×", digits(r.median)))
        };
        let all = e.summaries();
        let coverage = all
            .iter()
            .filter(|s| s.row.contender == "pack" && s.primitives >= 1000.0)
            .filter_map(|s| s.errors.coverage_ratio)
            .max_by(|a, b| a.abs().total_cmp(&b.abs()));
        writeln!(
            t,
            "| {} | {} | {} | {} | {} | {} | {} |",
            tree(e),
            e.subject.triangles,
            cell(Metric::Flip, 256),
            cell(Metric::Rmse, 256),
            cell(Metric::Flip, 64),
            cell(Metric::Rmse, 64),
            coverage.map_or("–".into(), |v| format!("{:+.1} %", 100.0 * v)),
        )?;
    }
    writeln!(t)?;
    Ok(t)
}

/// Two digits that count.
fn digits(v: f64) -> String {
    match v {
        v if v >= 10.0 => format!("{v:.0}"),
        v if v >= 1.95 => format!("{v:.1}"),
        v => format!("{v:.2}"),
    }
}
