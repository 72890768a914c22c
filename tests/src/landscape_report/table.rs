//! The report's text.

use anyhow::{Context, Result};
use std::fmt::Write;
use std::path::Path;

const BEGIN: &str = "<!-- make landscape: begin -->\n";
const END: &str = "<!-- make landscape: end -->\n";

/// Milliseconds, by the nearest rank.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Percentiles {
    p50: f64,
    p95: f64,
    p99: f64,
}

impl Percentiles {
    pub(crate) fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let rank = |p: f64| values[((p * values.len() as f64).ceil() as usize).max(1) - 1];
        Self { p50: rank(0.5), p95: rank(0.95), p99: rank(0.99) }
    }
}

/// One way to draw one scene.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    pub(crate) trees: usize,
    pub(crate) way: String,
    /// From the first camera.
    pub(crate) still: Percentiles,
    /// Along the path.
    pub(crate) flight: Option<Percentiles>,
    pub(crate) primitives: u64,
    pub(crate) drawn: u64,
    pub(crate) left_out: u64,
    pub(crate) bytes: u64,
    /// FLIP, and mean luminance over the truth's.
    pub(crate) error: [f64; 2],
}

impl Row {
    pub(crate) fn brief(&self) -> String {
        let [flip, bright] = self.error;
        let (way, ms) = (&self.way, self.still.p50);
        format!("  {way}: {ms:.0} ms, FLIP {flip:.3}, brightness {bright:.2}")
    }

    fn line(&self) -> String {
        let flight = match self.flight {
            Some(Percentiles { p50, p95, p99 }) => format!("{p50:.0} / {p95:.0} / {p99:.0}"),
            None => "–".into(),
        };
        let rest = match self.left_out {
            0 => String::new(),
            n => format!(" ({} left out)", count(n)),
        };
        format!(
            "| {} | {} | {:.0} | {flight} | {:.2} | {}{rest} | {:.0} | {:.3} | {:.2} |",
            count(self.trees as u64),
            self.way,
            self.still.p50,
            self.primitives as f64 / 1e6,
            count(self.drawn),
            self.bytes as f64 / 1e6,
            self.error[0],
            self.error[1]
        )
    }
}

fn count(n: u64) -> String {
    let digits = n.to_string();
    let groups: Vec<&str> = digits
        .as_bytes()
        .rchunks(3)
        .rev()
        .map(|g| std::str::from_utf8(g).unwrap_or_default())
        .collect();
    groups.join(",")
}

const HEAD: &str = "| trees | drawn as | frame, ms | flight p50 / p95 / p99, ms | millions of points and \
triangles | trees drawn | MB on the device | FLIP | brightness |\n|---|---|---|---|---|---|---|---|---|\n";

/// Writes docs/LANDSCAPE.md and the README's table.
pub(crate) fn write(root: &Path, adapter: &str, trees: &[String], rows: &[Row]) -> Result<()> {
    let mut text = format!(
        "# Landscapes\n\nWritten by `make landscape`: {} on fractal land, 80 m² a tree, 1280 × 720, one \
         sample a pixel, seen from camera `overview` (median of 5 frames; peers 3) and along path `flight` \
         (12 frames).\n\nAdapter: {adapter}.\n\n",
        trees.join(", ")
    );
    text += NOTES;
    writeln!(text, "\n{HEAD}{}", lines(rows, |_| true))?;
    let still = |trees: usize, way: &str| {
        let near = |r: &&Row| r.trees.abs_diff(trees) * 20 < trees && r.way == way;
        rows.iter().find(near).map(|r| r.still.p50)
    };
    writeln!(
        text,
        "Growth from 200,000 to 1,000,000 trees (same density, larger land, same view):\n"
    )?;
    let largest = rows.iter().filter(|r| r.trees > 500_000);
    for way in largest.map(|r| r.way.as_str()) {
        if let (Some(a), Some(b)) = (still(200_000, way), still(1_000_000, way)) {
            writeln!(text, "* {way}: {a:.0} to {b:.0} ms, × {:.2}", b / a)?;
        }
    }
    std::fs::write(root.join("docs/LANDSCAPE.md"), &text)?;
    let readme = root.join("README.md");
    let old = std::fs::read_to_string(&readme)?;
    let (before, rest) = old.split_once(BEGIN).context("README.md has no landscape table")?;
    let (_, after) = rest.split_once(END).context("README.md: the landscape table has no end")?;
    let few = |r: &Row| r.trees > 150_000;
    let table = format!("{HEAD}{}\n{adapter}; see docs/LANDSCAPE.md.\n", lines(rows, few));
    std::fs::write(&readme, format!("{before}{BEGIN}\n{table}\n{END}{after}"))?;
    println!("{}", root.join("docs/LANDSCAPE.md").display());
    Ok(())
}

fn lines(rows: &[Row], wanted: impl Fn(&Row) -> bool) -> String {
    rows.iter().filter(|r| wanted(r)).map(|r| r.line() + "\n").collect()
}

const NOTES: &str = "\
*FLIP* is the mean over three crops of 160 × 90 pixels (horizon, middle, foreground) against rays through all
trees at full detail with sun and sky shadows, 36 samples a pixel: one sample a pixel alone is noise, for all ways
alike. The shadows are the same for all (opacity maps along the sun and from above); our views are lit as foliage whose
leaves face all ways, all else by normals. By normals our views had FLIP 0.248 instead of 0.198 (200,000 trees, s_m 16).

Peers, drawn by the same device in the same run, all instanced, culled by tile and by tree on the CPU, from near
to far, with alpha tests and mips that keep coverage:

* *full meshes*: every tree its source, the nearest until 60 M triangles are drawn; the rest are left out (which
  is not seen in the foreground's crop, and is in the horizon's).
* *LOD meshes*: levels of a quarter of the triangles each; wood by meshoptimizer, foliage thinned at random and
  enlarged to keep its area (R. L. Cook et al. 2007: simplifiers leave card trees bare); the level by pixels a triangle.
* *billboards*: a quad a tree, the nearest of eight views of 256 texels, with normals and depth for the light.

*ours*: packs of points, triangles and views (289 directions, 128 texels); far trees are drawn by views, unless it says
*without views*. Drawn are trees that are neither beside the picture nor behind others, nor estimated to be; points are
those looked at. *Brightness* is the mean luminance of the crops over the truth's.
";
