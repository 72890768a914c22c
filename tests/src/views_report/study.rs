//! One tree, baked in many ways: number of views, layout, storage, mips, sky.

use anyhow::Result;
use forest_draw::ViewsLevel;
use forest_eval::{Errors, Plan, Truth, held_out_views, sweep, views_contenders};
use forest_pack::Pack;
use forest_raster::{Light, RayScene, Style, Sun, Surfaces};
use forest_soup::TriangleSoup;
use forest_tests::{bake_views, open};
use forest_views::{
    Channel, Channels, Directions, Dome, Layout, Lookup, Quality, ViewsBlock, ViewsOptions,
};
use glam::DVec3;
use std::fmt::Write;

/// Sides of the octahedral grids.
const SIDES: [u32; 6] = [5, 8, 12, 17, 24, 34];

/// The grid that is baked in other ways too.
const REFERENCE: u32 = 17;

/// Texels of a tile's side.
const TEXELS: u32 = 128;

/// Heights of the tree in pixels.
const HEIGHTS: [u32; 2] = [256, 64];

/// Errors of one bake: by look-up and height.
struct Errs([[Errors; 2]; 3]);

pub(crate) struct Study {
    /// By grid, with the stored bytes of colour and depth.
    counts: Vec<(u32, Errs, [u64; 2])>,
    rings: Errs,
    compressed: Errs,
    /// Bytes of all channels: lossless and compressed.
    bytes: [u64; 2],
    /// By level: texels, those that pass a test at the tiles' thresholds and at ½, over those of
    /// the finest level.
    mips: Vec<(u32, [f64; 2])>,
    /// Mean share of the sky in views and by rays, and root mean square difference of pixels.
    sky: [f64; 3],
}

fn options(directions: Directions) -> ViewsOptions {
    ViewsOptions {
        directions,
        texels: TEXELS,
        quality: Quality::Lossless,
        channels: Channels { sky: false, ..Channels::ALL },
        ..ViewsOptions::default()
    }
}

fn grid(side: u32) -> Directions {
    Directions { layout: Layout::Octahedral { side }, dome: Dome::Upper }
}

pub(crate) fn of(soup: &TriangleSoup) -> Result<Study> {
    let surfaces = Surfaces::new(&soup.materials, &soup.textures);
    let plan = Plan { heights: HEIGHTS.into(), views: 4, steps: 0, ..Plan::default() };
    let truth = Truth::new(soup, &surfaces, Style::default())?;
    let judge = |pack: &Pack| -> Result<Errs> {
        let block = ViewsBlock::open(pack)?;
        let levels = [ViewsLevel::read(&block, 0)?];
        let contenders = views_contenders(&levels);
        let found = sweep(&truth, &contenders, &plan, &|_| {})?;
        let names = ["views", "views-blend", "views-depth"];
        Ok(Errs(names.map(|name| {
            HEIGHTS.map(|height| {
                let rows = found.rows.iter();
                let of = rows.filter(|r| r.contender == name && r.height == height);
                Errors::mean(&of.map(|r| r.errors).collect::<Vec<_>>()).expect("rows")
            })
        })))
    };
    let mut counts = Vec::new();
    for side in SIDES {
        let pack = open(&bake_views(soup, &options(grid(side)))?)?;
        let block = ViewsBlock::open(&pack)?;
        let bytes = [Channel::Color, Channel::Depth].map(|c| block.channel_bytes(c, 0));
        counts.push((side, judge(&pack)?, bytes));
    }
    // As many views: 9 · 32 + 1 = 17².
    let rings = Directions { layout: Layout::Rings { rings: 9, points: 32 }, dome: Dome::Upper };
    let rings = judge(&open(&bake_views(soup, &options(rings))?)?)?;
    let full = options(grid(REFERENCE));
    let stored = |pack: &Pack| -> Result<u64> {
        let block = ViewsBlock::open(pack)?;
        Ok(Channel::ALL.iter().map(|c| block.channel_bytes(*c, 0)).sum())
    };
    let channels = Channels::ALL;
    let lossless = open(&bake_views(soup, &ViewsOptions { channels, ..full })?)?;
    let quality = Quality::Block;
    let small = open(&bake_views(soup, &ViewsOptions { channels, quality, ..full })?)?;
    Ok(Study {
        counts,
        rings,
        compressed: judge(&small)?,
        bytes: [stored(&lossless)?, stored(&small)?],
        mips: mips(&ViewsBlock::open(&lossless)?)?,
        sky: sky(soup, &surfaces, &lossless)?,
    })
}

/// Texels that pass an alpha test, level by level.
fn mips(block: &ViewsBlock) -> Result<Vec<(u32, [f64; 2])>> {
    let mut out: Vec<(u32, [f64; 2])> = Vec::new();
    for (level, tiles) in block.tiles.iter().enumerate() {
        let texels = block.texels(level)?;
        let side = block.header.levels[level].texels;
        let mut passing = [0u64; 2];
        for t in *tiles {
            for i in 0..i32::from(t.width) * i32::from(t.height) {
                let (x, y) = (i % i32::from(t.width), i / i32::from(t.width));
                let at = texels.index(t, x + i32::from(t.left), y + i32::from(t.top));
                let alpha = u16::from(texels.color[at.expect("within the tile")][3]);
                passing[0] += u64::from(alpha >= t.cutoff);
                passing[1] += u64::from(alpha >= 128);
            }
        }
        let area = f64::from(side).powi(2);
        out.push((side, passing.map(|p| p as f64 / area)));
    }
    let finest = out[0].1;
    Ok(out.into_iter().map(|(s, p)| (s, [p[0] / finest[0], p[1] / finest[1]])).collect())
}

/// The sky alone, on views and by rays.
fn sky(soup: &TriangleSoup, surfaces: &Surfaces, pack: &Pack) -> Result<[f64; 3]> {
    let light = Light::Sun(Sun {
        to_sun: DVec3::Y,
        sun: [0.0; 3],
        sky: [1.0; 3],
        translucency: 0.0,
        darkest: 1.0,
    });
    let block = ViewsBlock::open(pack)?;
    let level = ViewsLevel::read(&block, 0)?;
    let rays = RayScene::new(soup, surfaces);
    let frame = forest_eval::Frame::of(soup).expect("a tree");
    let (mut ours, mut theirs, mut square, mut n) = (0.0, 0.0, 0.0, 0.0);
    for view in held_out_views(3) {
        let camera = frame.camera(&view, 96.0, frame.side(96.0, 1));
        let shares = |picture: &dyn Fn(&Style) -> forest_raster::Picture| {
            let [lit, plain] =
                [light, Light::Albedo].map(|light| picture(&Style { light, ..Style::default() }));
            // What of the colour is left under the sky: the share, weighed by colour.
            let share = |(a, b): (&[f32; 4], &[f32; 4])| {
                let sum = |p: &[f32; 4]| f64::from(p[0] + p[1] + p[2]);
                (b[3] > 0.5 && sum(b) > 0.0).then(|| sum(a) / sum(b))
            };
            lit.pixels.iter().zip(&plain.pixels).map(share).collect::<Vec<_>>()
        };
        let views = shares(&|style| level.draw(&camera, Lookup::Depth, style).0);
        let truth = shares(&|style| rays.picture(&camera, style));
        for (a, b) in views.iter().zip(&truth).filter_map(|(a, b)| Some(((*a)?, (*b)?))) {
            (ours, theirs, square, n) = (ours + a, theirs + b, square + (a - b).powi(2), n + 1.0);
        }
    }
    Ok([ours / n, theirs / n, f64::sqrt(square / n)])
}

/// Views that `from` needs for `error`: log-log between the grids, `None` beyond them.
fn views_for(
    counts: &[(u32, Errs, [u64; 2])],
    look: usize,
    height: usize,
    error: f64,
) -> Option<f64> {
    let points: Vec<[f64; 2]> = counts
        .iter()
        .map(|(side, e, _)| [f64::from(side * side).ln(), e.0[look][height].rmse.ln()])
        .collect();
    points.windows(2).find_map(|w| {
        let [a, b] = [w[0], w[1]];
        let t = (error.ln() - a[1]) / (b[1] - a[1]);
        (0.0..=1.0).contains(&t).then(|| (a[0] + (b[0] - a[0]) * t).exp())
    })
}

pub(crate) fn write(t: &mut String, studies: &[(String, Study)]) -> Result<()> {
    let four = |f: &dyn Fn(usize) -> String| [0, 1, 2].map(f).join(" | ");
    writeln!(
        t,
        "\n## Error by number of views\n\nTiles of {TEXELS}², lossless, octahedral. RMSE at {} and {} pixels.\n",
        HEIGHTS[0], HEIGHTS[1]
    )?;
    writeln!(
        t,
        "| tree | views | nearest | blend | depth | nearest, far | blend, far | depth, far |"
    )?;
    writeln!(t, "|---|---|---|---|---|---|---|---|")?;
    for (name, s) in studies {
        for (side, e, _) in &s.counts {
            let cells = |h: usize| four(&|l| format!("{:.4}", e.0[l][h].rmse));
            writeln!(t, "| {name} | {} | {} | {} |", side * side, cells(0), cells(1))?;
        }
    }
    writeln!(
        t,
        "\n## How many views the nearest would need\n\nFor the error of depth-corrected look-up, by \
         interpolation of the table above; *memory* is that of colour alone for the nearest and the blend \
         against colour and depth (compressed: 16 and 24 bytes a block).\n\n\
         | tree | pixels | depth from | blend needs | nearest needs | memory, nearest over depth |\n\
         |---|---|---|---|---|---|"
    )?;
    let most = SIDES[SIDES.len() - 1].pow(2);
    for (name, s) in studies {
        for (h, height) in HEIGHTS.iter().enumerate() {
            for (side, e, _) in s.counts.iter().filter(|c| [5, 8, 12, 17].contains(&c.0)) {
                let need = |look| views_for(&s.counts, look, h, e.0[2][h].rmse);
                let text = |n: Option<f64>| match n {
                    Some(n) => format!("{n:.0}"),
                    None if e.0[2][h].rmse < s.counts[SIDES.len() - 1].1.0[0][h].rmse => {
                        format!("more than {most}")
                    }
                    None => format!("fewer than {}", SIDES[0].pow(2)),
                };
                let own = f64::from(side * side);
                let memory = need(0)
                    .map_or(format!("above {:.1}", f64::from(most) / own / 1.5), |n| {
                        format!("{:.1}", n / own / 1.5)
                    });
                let (blend, nearest) = (text(need(1)), text(need(0)));
                writeln!(t, "| {name} | {height} | {own} | {blend} | {nearest} | {memory} |")?;
            }
        }
    }
    writeln!(
        t,
        "\n## Layouts, storage, sky\n\n289 views each: 9 rings of 32 and the pole against 17 × 17. RMSE at \
         {} pixels; the ratio is that of rings over octahedral. Compression: RMSE of BC7 and BC4 over \
         lossless, and bytes of the finest level. Sky: mean share that views show and rays find, and the \
         RMS difference of pixels.\n",
        HEIGHTS[0]
    )?;
    writeln!(
        t,
        "| tree | rings nearest | ratio | rings blend | ratio | rings depth | ratio | compressed nearest | \
         depth | MiB lossless | compressed | sky in views | by rays | RMS |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|---|---|"
    )?;
    for (name, s) in studies {
        let own = &s.counts.iter().find(|c| c.0 == REFERENCE).expect("a grid").1;
        let rings = four(&|l| {
            let (a, b) = (s.rings.0[l][0].rmse, own.0[l][0].rmse);
            format!("{a:.4} | {:.2}", a / b)
        });
        let ratio = |l: usize| s.compressed.0[l][0].rmse / own.0[l][0].rmse;
        let mib = s.bytes.map(|b| b as f64 / f64::from(1 << 20));
        let [ours, theirs, rms] = s.sky;
        writeln!(
            t,
            "| {name} | {rings} | {:.3} | {:.3} | {:.1} | {:.1} | {ours:.3} | {theirs:.3} | {rms:.3} |",
            ratio(0),
            ratio(2),
            mib[0],
            mib[1],
        )?;
    }
    writeln!(
        t,
        "\n## Mips and the alpha test\n\nArea of the texels that pass, over that of the finest level: with \
         the threshold that each tile carries, and with ½ at every level.\n"
    )?;
    let levels: Vec<String> = studies[0].1.mips.iter().map(|m| format!("{}²", m.0)).collect();
    writeln!(t, "| tree | threshold | {} |", levels.join(" | "))?;
    writeln!(t, "|---|---|{}", "---|".repeat(levels.len()))?;
    for (name, s) in studies {
        for (k, what) in ["the tile's", "½"].iter().enumerate() {
            let cells: Vec<String> = s.mips.iter().map(|m| format!("{:.3}", m.1[k])).collect();
            writeln!(t, "| {name} | {what} | {} |", cells.join(" | "))?;
        }
    }
    Ok(())
}
