//! `make bench`: what a bake costs, by stage and size, beside meshoptimizer's simplify on the same
//! soup. Prints Markdown. Every case runs in a process of its own, so that its peak of memory is its
//! own; runs of both programs alternate, because machines drift: compare ratios and medians.

mod coverage;
mod large;
mod truth;

use anyhow::{Context, Result, bail};
use forest_import::{Block, Limits};
use forest_points::{BakeOptions, RadiusRule, SurfelSize, bake};
use forest_sample_data::{Species, grow};
use forest_soup::TriangleSoup;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::process::Command;
use std::time::Instant;

/// Runs of a case; medians are quoted.
const RUNS: usize = 5;

/// What one process found out.
#[derive(Serialize, Deserialize)]
struct Found {
    triangles: u64,
    /// At one surfel a triangle, points only: seconds of each run, and of simplify to 10 %.
    bake: Vec<f64>,
    simplify: Vec<f64>,
    /// Share of the area that simplify keeps.
    simplify_area: f64,
    /// The default bake, triangles and textures included.
    full: Option<Bake>,
    plain: Bake,
}

#[derive(Clone, Serialize, Deserialize)]
struct Bake {
    surfels: u64,
    seconds: f64,
    stages: Vec<(String, f64)>,
    /// Peak of memory above the loaded soup, in bytes a surfel.
    memory: f64,
}

fn main() -> Result<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    match args.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["case", name, runs, full] => {
            let found = case(name, runs.parse()?, full == "full")?;
            println!("{}", serde_json::to_string(&found)?);
            Ok(())
        }
        [] => report().and_then(|()| large::report()),
        ["large"] => large::report(),
        _ => bail!("usage: bench [large]"),
    }
}

/// The soup of a case: a generated tree, or a file.
fn soup(name: &str) -> Result<TriangleSoup> {
    let model = match name.split_once(' ') {
        Some(("conifer", n)) => grow(Species::Conifer, 1, n.parse()?),
        Some(("broadleaf", n)) => grow(Species::Broadleaf, 1, n.parse()?),
        _ => Block::parse(&[name])?.load(&Limits::default())?.model,
    };
    Ok(model.flatten(100_000_000)?)
}

fn case(name: &str, runs: usize, full: bool) -> Result<Found> {
    let soup = soup(name)?;
    let one_each = BakeOptions {
        surfel_size: SurfelSize::Triangle,
        triangles: false,
        ..BakeOptions::default()
    };
    let (mut bakes, mut simplifies) = (Vec::new(), Vec::new());
    let (mut plain, mut simplify_area) = (None, 0.0);
    for _ in 0..runs {
        let run = timed(&soup, &one_each)?;
        bakes.push(run.seconds);
        plain = Some(run);
        let start = Instant::now();
        let kept = simplify(&soup);
        simplifies.push(start.elapsed().as_secs_f64());
        simplify_area = area(&soup, kept.chunks_exact(3)) / area(&soup, soup.triangles.iter());
    }
    let full = full.then(|| timed(&soup, &BakeOptions::default())).transpose()?;
    Ok(Found {
        triangles: soup.triangles.len() as u64,
        bake: bakes,
        simplify: simplifies,
        simplify_area,
        full,
        plain: plain.context("no run")?,
    })
}

/// From the decoded soup to the finished pack on disk.
fn timed(soup: &TriangleSoup, options: &BakeOptions) -> Result<Bake> {
    let dir = tempfile::tempdir()?;
    let before = memory("VmRSS:")?;
    // Lets the kernel count the peak anew.
    std::fs::write("/proc/self/clear_refs", "5")?;
    let start = Instant::now();
    let mut writer = forest_pack::PackWriter::create(&dir.path().join("t.fpack"))?;
    let report = bake(soup, options, &mut writer, &|_| {})?;
    writer.finish()?;
    let seconds = start.elapsed().as_secs_f64();
    let peak = memory("VmHWM:")?.saturating_sub(before);
    let surfels = report.header.counts.surfels;
    let stages = report.times.stages().map(|(n, t)| (n.to_string(), t.seconds())).to_vec();
    Ok(Bake { surfels, seconds, stages, memory: peak as f64 / surfels as f64 })
}

/// Bytes from a line of /proc/self/status.
fn memory(line: &str) -> Result<u64> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let value = status.lines().find_map(|l| l.strip_prefix(line)).context("no such line")?;
    Ok(value.trim().trim_end_matches(" kB").parse::<u64>()? * 1024)
}

/// One level of meshoptimizer: a tenth of the triangles, as gltfpack would ask for it.
fn simplify(soup: &TriangleSoup) -> Vec<u32> {
    let positions: &[u8] = bytemuck::cast_slice(&soup.positions);
    let vertices =
        meshopt::VertexDataAdapter::new(positions, 12, 0).expect("positions of 12 bytes");
    let indices = soup.triangles.as_flattened();
    let options = meshopt::SimplifyOptions::None;
    meshopt::simplify(indices, &vertices, indices.len() / 30 * 3, 0.01, options, None)
}

fn area<T: AsRef<[u32]>>(soup: &TriangleSoup, triangles: impl Iterator<Item = T>) -> f64 {
    let one = |t: T| {
        let t = t.as_ref();
        let [a, b, c] = [t[0], t[1], t[2]].map(|v| soup.positions[v as usize].as_dvec3());
        (b - a).cross(c - a).length() * 0.5
    };
    triangles.map(one).sum()
}

fn report() -> Result<()> {
    let trees = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/trees");
    let mut names: Vec<String> = ["conifer 20000", "broadleaf 200000"].map(String::from).into();
    for file in [
        "sap_birch_200k.glb",
        "japaneseMaple/japaneseMaple.obj",
        "ez_oak_dense_200k.glb",
        "sap_jmaple_450k.glb",
    ] {
        let path = trees.join(file);
        if path.exists() {
            names.push(path.to_string_lossy().into_owned());
        } else {
            eprintln!("skipped: {} is not there", path.display());
        }
    }
    println!("# What a bake costs\n");
    println!(
        "{}, {} threads, {}.",
        forest_eval::machine(),
        std::thread::available_parallelism()?,
        today()?
    );
    println!(
        "\n## Beside meshoptimizer: one surfel a triangle, all levels, against one level of 10 %\n"
    );
    println!(
        "| tree | triangles | bake, s | simplify, s | bake / simplify | area simplify keeps |"
    );
    println!("|---|---|---|---|---|---|");
    let mut full = Vec::new();
    for name in &names {
        let f = child(name, RUNS, true)?;
        let ratios = f.bake.iter().zip(&f.simplify).map(|(a, b)| a / b).collect();
        println!(
            "| {} | {} | {:.3} | {:.3} | {:.2} | {:.0} % |",
            short(name),
            f.triangles,
            median(f.bake),
            median(f.simplify),
            median(ratios),
            100.0 * f.simplify_area
        );
        full.extend(f.full.map(|b| (short(name), b)));
    }
    println!("\n## The default bake, triangles and textures included\n");
    println!(
        "Seconds by stage; those of surfels, cluster, sort and triangles are summed over threads.\n"
    );
    table(&full);
    truth_report(&names)?;
    coverage_report(&names)?;
    println!("\n## Size: one surfel a triangle, points only\n");
    let mut sizes = Vec::new();
    for n in ["200000", "2000000", "20000000"] {
        let f = child(&format!("broadleaf {n}"), 1, false)?;
        sizes.push((format!("broadleaf {n}"), f.plain));
    }
    table(&sizes);
    let cost = |b: &Bake| b.seconds / b.surfels as f64;
    if let [first, .., last] = &sizes[..] {
        println!(
            "\nA surfel costs {:.2} times as much at {} as at {}.",
            cost(&last.1) / cost(&first.1),
            last.0,
            first.0
        );
    }
    Ok(())
}

fn truth_report(names: &[String]) -> Result<()> {
    println!("\n## Ground truth\n");
    println!(
        "Seconds of a picture of {0}×{0} pixels with 64 samples each that shows all of the tree; with a sun \
         and a sky, both cast shadows. Metrics: milliseconds on the box of a tree {0} pixels high; the rest \
         is RMSE, PSNR, coverage, silhouette and depth.\n",
        truth::SIDE
    );
    println!(
        "| tree | covers | scanlines | rays, albedo | rays / scanlines | hierarchy | rays, sun and sky | box | \
         FLIP | SSIM | the rest |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for name in names {
        let soup = soup(name)?;
        let t = truth::truths(&soup)?;
        let m = truth::metrics(&soup)?;
        println!(
            "| {} | {:.0} % | {:.2} | {:.2} | {:.1} | {:.2} | {:.2} | {}×{} | {:.0} | {:.0} | {:.1} |",
            short(name),
            100.0 * t.coverage,
            t.scanlines,
            t.rays,
            t.rays / t.scanlines,
            t.hierarchy,
            t.lit,
            m.size[0],
            m.size[1],
            m.flip,
            m.ssim,
            m.rest
        );
    }
    Ok(())
}

fn coverage_report(names: &[String]) -> Result<()> {
    println!("\n## Coverage of cuts\n");
    println!(
        "Signed error of the mean coverage against the source's picture, over 16 views that neither bakes \
         nor calibrations know, with the worst view in brackets; points of each cut. Trees {} pixels \
         high, 64 samples a pixel.\n",
        coverage::HEIGHT
    );
    let cuts: Vec<String> = coverage::CUTS.iter().map(|c| format!("s_m {c} px²")).collect();
    println!("| tree | radius | {} |", cuts.join(" | "));
    println!("|---|---|{}", "---|".repeat(cuts.len()));
    for name in names {
        let soup = soup(name)?;
        for (radius, calibrated) in [
            (RadiusRule::Opacity, true),
            (RadiusRule::Opacity, false),
            (RadiusRule::Area, false),
            (RadiusRule::Paper, false),
        ] {
            let rows = coverage::measure(&soup, radius, calibrated)?;
            let cells: Vec<String> = rows
                .iter()
                .map(|r| {
                    let (mean, worst) = (100.0 * r.error, 100.0 * r.worst);
                    format!("{mean:+.1} % ({worst:+.1}), {}", r.points)
                })
                .collect();
            let rule = if calibrated { "calibrated" } else { "" };
            println!("| {} | {radius:?} {rule} | {} |", short(name), cells.join(" | "));
        }
    }
    Ok(())
}

fn table(rows: &[(String, Bake)]) {
    let Some((_, first)) = rows.first() else { return };
    let stages: Vec<&str> = first.stages.iter().map(|s| s.0.as_str()).collect();
    println!(
        "| tree | surfels | s | M surfels/s | bytes a surfel at the peak | {} |",
        stages.join(" | ")
    );
    println!("|---|---|---|---|---|{}", "---|".repeat(stages.len()));
    for (name, b) in rows {
        let stages: Vec<String> = b.stages.iter().map(|s| format!("{:.3}", s.1)).collect();
        println!(
            "| {name} | {} | {:.3} | {:.2} | {:.0} | {} |",
            b.surfels,
            b.seconds,
            b.surfels as f64 / b.seconds / 1e6,
            b.memory,
            stages.join(" | ")
        );
    }
}

fn child(name: &str, runs: usize, full: bool) -> Result<Found> {
    let output = Command::new(std::env::current_exe()?)
        .args(["case", name, &runs.to_string(), if full { "full" } else { "plain" }])
        .output()?;
    if !output.status.success() {
        bail!("{name}: {}", String::from_utf8_lossy(&output.stderr));
    }
    Ok(serde_json::from_slice(&output.stdout)?)
}

fn median(mut v: Vec<f64>) -> f64 {
    v.sort_by(f64::total_cmp);
    v[v.len() / 2]
}

fn short(name: &str) -> String {
    Path::new(name).file_name().unwrap_or_default().to_string_lossy().into_owned()
}

fn today() -> Result<String> {
    let output = Command::new("date").arg("+%Y-%m-%d").output()?;
    Ok(String::from_utf8_lossy(&output.stdout).trim().to_string())
}
