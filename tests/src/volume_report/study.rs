//! One tree as a volume, in many ways: pruning, codebooks, coarser levels, tri-grid.

use anyhow::Result;
use forest_draw::VolumeScene;
use forest_eval::{Errors, Plan, Truth, held_out_views, sweep, volume_contenders};
use forest_raster::{Picture, Sampling, Style, Surfaces};
use forest_soup::TriangleSoup;
use forest_tests::{open, write_volume};
use forest_volume::{
    Blending, Branching, Centers, Coarse, CodebookOptions, CodebookSize, Detail, Prune, Quality,
    Space, Stand, Volume, VolumeBlock, VolumeOptions,
};
use std::fmt::Write;
use std::time::Instant;

const STAND: Stand = Stand::Dome { cameras: 16 };
const WORDS: [usize; 4] = [256, 512, 1024, 2048];

/// The paper's three curves.
const CURVES: [(&str, Space, Centers); 3] = [
    ("RGB", Space::Rgb, Centers::Mean),
    ("Lab", Space::Lab, Centers::Mean),
    ("Lab, modified", Space::Lab, Centers::Nearest),
];

/// Height of the tree in pixels.
const HEIGHT: u32 = 256;

/// A way to prune, and what it gave.
struct Pruned {
    name: &'static str,
    /// Of each level: cells, pairs, hidden and blank shares of them.
    levels: Vec<(u64, u64, [f64; 2])>,
    /// Billboards of the finest level that are drawn in a view.
    drawn: f64,
    errors: Errors,
}

/// A codebook, and what it gave.
struct Coded {
    curve: usize,
    words: usize,
    quality: Quality,
    bytes: u64,
    seconds: f64,
    /// Of 512 codewords.
    errors: Option<Errors>,
}

pub(crate) struct Study {
    triangles: usize,
    /// All, photographing, opacity.
    seconds: [f64; 3],
    pruned: Vec<Pruned>,
    raw_bytes: u64,
    node_bytes: u64,
    coded: Vec<Coded>,
    /// Bytes with 512 codewords and BC3, and errors.
    block: (u64, Errors),
    raw: Errors,
    /// Of levels 6 to 3: errors of textures from photographs and from the level below.
    coarse: Vec<(u32, [Errors; 2])>,
    /// Share of the texture time that coarser levels take.
    coarse_share: f64,
    /// Root mean square of a switch to the next coarser level, in 8-bit values: octree 7, 6, 5, 4 and
    /// tri-grid 5, 4, 3; with billboards drawn before and after.
    switches: [Vec<(u32, f64, [f64; 2])>; 2],
    /// Billboards of the default octree and tri-grid before and after pruning, and raw bytes.
    branching: [([u64; 2], u64); 2],
}

/// Draws and judges one volume's pack.
struct Judge<'a> {
    truth: Truth<'a>,
}

impl Judge<'_> {
    /// Errors of `level` at its height: that at which its texels are about a pixel.
    fn errors(&self, bytes: &[u8], level: u32, height: u32) -> Result<(Errors, f64)> {
        let pack = open(bytes)?;
        let block = VolumeBlock::open(&pack)?;
        let scene = VolumeScene::read(&block)?;
        let sampling = Sampling { side: 4, seed: 1 };
        let plan = Plan { heights: vec![height], views: 4, steps: 0, sampling, ..Plan::default() };
        let mut contenders = volume_contenders(Some(&scene));
        contenders.iter_mut().for_each(|c| c.only_level(level));
        let found = sweep(&self.truth, &contenders, &plan, &|_| {})?;
        let errors: Vec<Errors> = found.rows.iter().map(|r| r.errors).collect();
        let drawn = found.rows.iter().map(|r| r.cost.primitives).sum::<f64>();
        Ok((Errors::mean(&errors).expect("rows"), drawn / found.rows.len() as f64))
    }

    /// Root mean square difference of two levels, over pixels that either shows, of 8-bit sRGB
    /// over grey, in the mean over the channels and four views; and billboards drawn.
    fn switch(&self, scene: &VolumeScene, level: u32) -> (f64, [f64; 2]) {
        let (mut sum, mut drawn) = (0.0, [0.0; 2]);
        let views = held_out_views(4);
        for view in &views {
            let side = self.truth.frame.side(f64::from(HEIGHT), 1);
            let camera = self.truth.frame.camera(view, f64::from(HEIGHT), side);
            let sampling = Sampling { side: 4, seed: 1 };
            let [a, b] = [level, level - 1].map(|l| {
                scene.draw(&camera, Detail::Level(l), Blending::Shares, Style::from(sampling))
            });
            drawn = [drawn[0] + a.1.billboards as f64, drawn[1] + b.1.billboards as f64];
            sum += rms(&a.0, &b.0);
        }
        let n = views.len() as f64;
        (sum / n, drawn.map(|d| d / n))
    }
}

fn rms(a: &Picture, b: &Picture) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    let shown = a.pixels.iter().zip(&b.pixels).map(|(p, q)| p[3] + q[3] > 0.0);
    for ((p, q), shown) in a.over(0.5).iter().zip(b.over(0.5)).zip(shown) {
        if shown {
            let square = |(p, q): (&u8, u8)| f64::from(p.abs_diff(q)).powi(2);
            sum += p.iter().zip(q).map(square).sum::<f64>() / 3.0;
            count += 1.0;
        }
    }
    (sum / f64::max(count, 1.0)).sqrt()
}

fn volume(soup: &TriangleSoup, surfaces: &Surfaces, options: &VolumeOptions) -> Result<Volume> {
    Ok(Volume::from_mesh(soup, surfaces, STAND, options, &|_| {})?)
}

fn drawn_levels(v: &Volume) -> Vec<(u64, u64, [f64; 2])> {
    let share = |n: u64, of: u64| n as f64 / of.max(1) as f64;
    let of = |l: &forest_volume::LevelCounts| {
        (l.cells, l.pairs, [share(l.hidden, l.pairs), share(l.blank, l.pairs)])
    };
    v.report.levels.iter().map(of).collect()
}

pub(crate) fn of(soup: &TriangleSoup) -> Result<Study> {
    let surfaces = Surfaces::new(&soup.materials, &soup.textures);
    let style = Style { sampling: Sampling { side: 4, seed: 1 }, ..Style::default() };
    let judge = Judge { truth: Truth::new(soup, &surfaces, style)? };
    let default = VolumeOptions::default();
    let start = Instant::now();
    let reference = volume(soup, &surfaces, &default)?;
    let all = start.elapsed().as_secs_f64();
    let r = &reference.report;
    let [finest, coarser] = r.billboards.map(|d| d.as_secs_f64());
    let seconds = [all, r.photographs.as_secs_f64(), r.opacity.as_secs_f64()];
    let (raw_pack, raw_report) = write_volume(&reference, None)?;
    let (raw, drawn) = judge.errors(&raw_pack, default.levels, HEIGHT)?;
    let mut pruned = vec![Pruned {
        name: "camera and neighbours, 0.98",
        levels: drawn_levels(&reference),
        drawn,
        errors: raw,
    }];
    let own = VolumeOptions { prune_by: Prune::Own, ..default };
    let made = volume(soup, &surfaces, &own)?;
    let (errors, drawn) = judge.errors(&write_volume(&made, None)?.0, default.levels, HEIGHT)?;
    let levels = drawn_levels(&made);
    pruned.push(Pruned { name: "camera alone (the paper's), 0.98", levels, drawn, errors });
    let mut coded = Vec::new();
    for (curve, &(_, space, centers)) in CURVES.iter().enumerate() {
        for words in WORDS {
            let options = CodebookOptions {
                size: CodebookSize::Words(words),
                space,
                centers,
                ..CodebookOptions::default()
            };
            let start = Instant::now();
            let (pack, report) = write_volume(&reference, Some(&options))?;
            let seconds = start.elapsed().as_secs_f64();
            let errors = match words {
                512 => Some(judge.errors(&pack, default.levels, HEIGHT)?.0),
                _ => None,
            };
            let (quality, bytes) = (report.quality.expect("codebooks"), report.texture_bytes);
            coded.push(Coded { curve, words, quality, bytes, seconds, errors });
        }
    }
    let options = CodebookOptions { block: true, ..CodebookOptions::default() };
    let (pack, report) = write_volume(&reference, Some(&options))?;
    let block = (report.texture_bytes, judge.errors(&pack, default.levels, HEIGHT)?.0);
    let below = VolumeOptions { coarse: Coarse::Below, ..default };
    let below = write_volume(&volume(soup, &surfaces, &below)?, None)?.0;
    let mut coarse = Vec::new();
    for (level, height) in [(6, 128), (5, 64), (4, 32), (3, 16)] {
        let of = |pack: &[u8]| judge.errors(pack, level, height);
        coarse.push((level, [of(&raw_pack)?.0, of(&below)?.0]));
    }
    let tri = VolumeOptions {
        branching: Branching::TriGrid,
        levels: Branching::TriGrid.usual_levels(),
        ..default
    };
    let tri = volume(soup, &surfaces, &tri)?;
    let (tri_pack, tri_report) = write_volume(&tri, None)?;
    let mut switches = [Vec::new(), Vec::new()];
    for (packed, levels, out) in [(&raw_pack, 5..=7, 0), (&tri_pack, 3..=5, 1)] {
        let pack = open(packed)?;
        let opened = VolumeBlock::open(&pack)?;
        let scene = VolumeScene::read(&opened)?;
        for level in levels.rev() {
            let (rms, drawn) = judge.switch(&scene, level);
            switches[out].push((level, rms, drawn));
        }
    }
    let counts = |v: &Volume| {
        let pairs = v.report.levels.iter().map(|l| l.pairs).sum();
        [pairs, v.billboards()]
    };
    Ok(Study {
        triangles: soup.triangles.len(),
        seconds,
        pruned,
        raw_bytes: raw_report.raw_bytes,
        node_bytes: raw_report.node_bytes,
        coded,
        block,
        raw,
        coarse,
        coarse_share: coarser / (finest + coarser),
        switches,
        branching: [
            (counts(&reference), raw_report.raw_bytes),
            (counts(&tri), tri_report.raw_bytes),
        ],
    })
}

const MB: f64 = 1e6;

pub(crate) fn write(t: &mut String, studies: &[(String, Study)]) -> Result<()> {
    memory(t, studies)?;
    pruning(t, studies)?;
    codebooks(t, studies)?;
    coarser(t, studies)?;
    switches(t, studies)?;
    Ok(())
}

fn memory(t: &mut String, studies: &[(String, Study)]) -> Result<()> {
    writeln!(
        t,
        "\n## Texture memory\n\nRaw is four bytes a texel. Coded: numbers of codewords and the atlas, 512 of \
         colour and of alpha; BC3: the atlas as DXT5. Nodes and camera masks come on top, coded or not. \
         Seconds are those of the volume without codebooks, of which photographing and opacity, and of \
         training and writing. The paper: 72 → 3.1, 60 → 2.1 and 86 → 6.3 MB, \"19:1\" on average, \"76:1\" \
         with DXT5 counted as a quarter; its own figures give {:.1}, {:.1} and {:.1} to 1. For a scene of \
         three trees it says 641 → 2.9 MB, \"240:1\"; that is {:.0} to 1.\n\n\
         | tree | triangles | billboards | raw MB | coded MB | ratio | with BC3 | ratio | nodes MB | s | \
         photographs | opacity | codebooks |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|",
        72.0 / 3.1,
        60.0 / 2.1,
        86.0 / 6.3,
        641.0 / 2.9,
    )?;
    for (name, s) in studies {
        let coded = s.default_coded();
        let raw = s.raw_bytes as f64;
        writeln!(
            t,
            "| {name} | {} | {} | {:.1} | {:.2} | {:.0} : 1 | {:.2} | {:.0} : 1 | {:.1} | {:.1} | {:.1} | {:.1} | {:.1} |",
            s.triangles,
            s.branching[0].0[1],
            raw / MB,
            coded.bytes as f64 / MB,
            raw / coded.bytes as f64,
            s.block.0 as f64 / MB,
            raw / s.block.0 as f64,
            s.node_bytes as f64 / MB,
            s.seconds[0],
            s.seconds[1],
            s.seconds[2],
            coded.seconds,
        )?;
    }
    Ok(())
}

impl Study {
    /// 512 codewords in Lab from the training set.
    fn default_coded(&self) -> &Coded {
        self.coded.iter().find(|c| c.curve == 2 && c.words == 512).expect("the default")
    }
}

fn pruning(t: &mut String, studies: &[(String, Study)]) -> Result<()> {
    writeln!(
        t,
        "\n## Pruning\n\nShares of the pairs of cell and camera that have no billboard: hidden by what is \
         before the cell, or blank. *Drawn* are billboards of the finest level in a view, of two cameras; \
         errors at {HEIGHT} pixels, raw textures. The paper's counts are of a view, \"computed by rotating \
         around the tree\": 154,000 → 53,000 for the dense oak (65 %), 54,000 → 43,000 for the pine, 35,000 → \
         33,000 for the small oak. What is hidden from one camera is seen between it and the next: pruning \
         by the camera alone leaves holes, which the coverage shows.\n\n\
         | tree | pruned by | hidden: level 7 | 6 | 5 | 4 | 3 | blank: level 7 | drawn | FLIP | RMSE | coverage |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|"
    )?;
    for (name, s) in studies {
        for p in &s.pruned {
            let hidden: Vec<String> = (3..=7)
                .rev()
                .map(|l| {
                    p.levels.get(l).map_or(String::new(), |l| format!("{:.1} %", 100.0 * l.2[0]))
                })
                .collect();
            writeln!(
                t,
                "| {name} | {} | {} | {:.1} % | {:.0} | {:.4} | {:.4} | {:+.1} % |",
                p.name,
                hidden.join(" | "),
                100.0 * p.levels.last().map_or(0.0, |l| l.2[1]),
                p.drawn,
                p.errors.flip,
                p.errors.rmse,
                100.0 * p.errors.coverage_ratio.unwrap_or(0.0),
            )?;
        }
    }
    Ok(())
}

fn codebooks(t: &mut String, studies: &[(String, Study)]) -> Result<()> {
    writeln!(
        t,
        "\n## Codebooks\n\nPSNR (dB) of the sRGB values of texels that are not blank and mean CIELab difference \
         against the number of codewords, for the paper's three curves (its figure 6): generalised Lloyd in \
         RGB, in CIELab, and in CIELab with codewords replaced by the nearest billboard. FLIP, RMSE and \
         coverage are those of the picture at {HEIGHT} pixels, beside those of raw textures.\n\n\
         | tree | curve | 256: PSNR | ΔE | 512: PSNR | ΔE | 1024: PSNR | ΔE | 2048: PSNR | ΔE | alpha PSNR, 512 | \
         FLIP, 512 (raw) | RMSE, 512 (raw) | coverage, 512 (raw) |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|"
    )?;
    for (name, s) in studies {
        for (curve, (label, ..)) in CURVES.iter().enumerate() {
            let of = |words| s.coded.iter().find(|c| c.curve == curve && c.words == words);
            let cells: Vec<String> = WORDS
                .iter()
                .filter_map(|&w| of(w))
                .map(|c| format!("{:.2} | {:.2}", c.quality.color_psnr, c.quality.delta_e))
                .collect();
            let Some((c, errors)) = of(512).and_then(|c| Some((c, c.errors?))) else { continue };
            let percent = |e: &Errors| 100.0 * e.coverage_ratio.unwrap_or(0.0);
            writeln!(
                t,
                "| {name} | {label} | {} | {:.2} | {:.4} ({:.4}) | {:.4} ({:.4}) | {:+.1} % ({:+.1} %) |",
                cells.join(" | "),
                c.quality.alpha_psnr,
                errors.flip,
                s.raw.flip,
                errors.rmse,
                s.raw.rmse,
                percent(&errors),
                percent(&s.raw),
            )?;
        }
        writeln!(
            t,
            "| {name} | the third, BC3 | | | | | | | | | | {:.4} | {:.4} | |",
            s.block.1.flip, s.block.1.rmse
        )?;
    }
    Ok(())
}

fn coarser(t: &mut String, studies: &[(String, Study)]) -> Result<()> {
    writeln!(
        t,
        "\n## Coarser levels: from the photographs, or averaged from below\n\nRMSE (coverage) at the height \
         where texels are about a pixel, raw textures, from the photographs / from the level below; and the \
         share of the texture time that coarser levels take from photographs (the paper: 37.5 %).\n\n\
         | tree | level 6, 128 px | 5, 64 px | 4, 32 px | 3, 16 px | time |\n|---|---|---|---|---|---|"
    )?;
    for (name, s) in studies {
        let cells: Vec<String> = s
            .coarse
            .iter()
            .map(|(_, [a, b])| {
                let percent = |e: &Errors| 100.0 * e.coverage_ratio.unwrap_or(0.0);
                format!(
                    "{:.4} ({:+.1} %) / {:.4} ({:+.1} %)",
                    a.rmse,
                    percent(a),
                    b.rmse,
                    percent(b)
                )
            })
            .collect();
        writeln!(t, "| {name} | {} | {:.0} % |", cells.join(" | "), 100.0 * s.coarse_share)?;
    }
    Ok(())
}

fn switches(t: &mut String, studies: &[(String, Study)]) -> Result<()> {
    writeln!(
        t,
        "\n## Switches between levels: octree and tri-grid\n\nRoot mean square difference of the pictures of \
         two adjacent levels at {HEIGHT} pixels, in 8-bit sRGB over grey, over the pixels that show something; \
         in brackets the billboards drawn. The paper, at its own sizes: 31.6 for a tri-grid (level 4 to 3, \
         51,000 to 3,800 polygons), 24.6 for an octree (6 to 5, 34,000 to 6,300). Billboards of all levels and \
         cameras before → after pruning, and their raw texels; the paper has 361,000, 152,000 and 114,000 \
         billboards in a tri-grid of 5 levels, and 266, 147 and 228 MB.\n\n\
         | tree | octree 7 → 6 | 6 → 5 | 5 → 4 | tri-grid 5 → 4 | 4 → 3 | 3 → 2 | octree billboards | MB | \
         tri-grid billboards | MB |\n|---|---|---|---|---|---|---|---|---|---|---|"
    )?;
    for (name, s) in studies {
        let cells: Vec<String> = s
            .switches
            .iter()
            .flatten()
            .map(|(_, rms, [a, b])| format!("{rms:.1} ({a:.0} → {b:.0})"))
            .collect();
        let counts: Vec<String> = s
            .branching
            .iter()
            .map(|([pairs, kept], bytes)| format!("{pairs} → {kept} | {:.0}", *bytes as f64 / MB))
            .collect();
        writeln!(t, "| {name} | {} | {} |", cells.join(" | "), counts.join(" | "))?;
    }
    Ok(())
}
