//! `forest-bake inspect`.

mod foliage;
mod volume;

use crate::all::Preset;
use crate::output;
use anyhow::{Context, Result};
use foliage::FoliageReport;
use forest_foliage::FoliageBlock;
use forest_pack::header::{self, Meta};
use forest_pack::measures::{Measure, Measures};
use forest_pack::{Codec, Pack, SectionId, kind};
use forest_points::{BakeCounts, PointsBlock};
use forest_views::{Channel, Dome, Layout, LevelHeader, Lookup, Quality, ViewsBlock};
use forest_volume::VolumeBlock;
use serde::Serialize;
use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::PathBuf;
use volume::VolumeReport;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Pack to look into.
    #[arg(value_name = "PACK", required_unless_present = "presets")]
    pack: Option<PathBuf>,
    /// Print the presets of `all`, and stop.
    #[arg(long)]
    presets: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Report {
    schema: &'static str,
    file: PathBuf,
    bytes: u64,
    generator: String,
    source_hash: String,
    sources: Vec<SourceReport>,
    /// The preset and options of `all`; empty where representations were baked one by one.
    options: Vec<String>,
    sections: Vec<SectionReport>,
    points: Option<PointsReport>,
    views: Option<ViewsReport>,
    volume: Option<VolumeReport>,
    foliage: Option<FoliageReport>,
    measures: Option<Measures>,
}

#[derive(Serialize)]
struct SourceReport {
    name: String,
    hash: String,
    placement: String,
}

#[derive(Serialize)]
struct SectionReport {
    name: String,
    index: u32,
    codec: &'static str,
    stored_bytes: u64,
    bytes: u64,
}

/// Lengths are world units.
#[derive(Serialize)]
struct PointsReport {
    min: [f64; 3],
    max: [f64; 3],
    grid: [u32; 3],
    cells: usize,
    order: String,
    radius: String,
    counts: BakeCounts,
    triangles: usize,
    /// Null for one surfel a triangle.
    surfel_size: Option<f64>,
    alpha_tolerance: f64,
    /// Positions are off by at most this along each axis.
    position_error: f64,
    bytes_per_surfel: f64,
    /// Whether the points' areas were corrected by what was seen (`points --measure`).
    calibrated: bool,
    /// Radii of the finest and the coarsest point.
    radius_range: [f64; 2],
}

/// Lengths are world units.
#[derive(Serialize)]
struct ViewsReport {
    /// Number of views.
    count: u32,
    /// How they are spread.
    layout: String,
    /// Whether there are views from below the horizon.
    full_sphere: bool,
    center: [f64; 3],
    /// Width of a tile.
    tile_width: f64,
    samples_a_texel: u32,
    quality: String,
    channels: Vec<&'static str>,
    levels: Vec<ViewsLevelReport>,
}

#[derive(Serialize)]
struct ViewsLevelReport {
    /// Texels along the side of a tile.
    texels: u32,
    page: [u32; 2],
    pages: u32,
    /// Stored bytes of all channels.
    bytes: u64,
}

impl ViewsReport {
    fn of(block: &ViewsBlock) -> Self {
        let h = &block.header;
        let stored = || Channel::ALL.into_iter().filter(|c| h.channels.has(*c));
        let level = |(i, l): (usize, &LevelHeader)| ViewsLevelReport {
            texels: l.texels,
            page: l.page,
            pages: l.pages,
            bytes: stored().map(|c| block.channel_bytes(c, i)).sum(),
        };
        let name = |c| match c {
            Channel::Color => "color",
            Channel::Normal => "normal",
            Channel::Depth => "depth",
            Channel::Sky => "ao",
        };
        Self {
            count: h.directions.count(),
            layout: match h.directions.layout {
                Layout::Octahedral { side } => format!("octahedral {side}×{side}"),
                Layout::Rings { rings, points } => format!("{rings} rings of {points}, and poles"),
            },
            full_sphere: h.directions.dome == Dome::Full,
            center: h.center,
            tile_width: 2.0 * h.half,
            samples_a_texel: h.samples,
            quality: match h.quality {
                Quality::Lossless => "lossless".into(),
                Quality::Block => "BC7, BC5, BC4".into(),
            },
            channels: stored().map(name).collect(),
            levels: h.levels.iter().enumerate().map(level).collect(),
        }
    }

    fn text(&self, t: &mut String) -> std::fmt::Result {
        let dome = if self.full_sphere { "all around" } else { "from the horizon up" };
        writeln!(t, "views")?;
        writeln!(t, "  directions          {}, {}, {dome}", self.count, self.layout)?;
        writeln!(t, "  tiles               {:.3} wide about {:.3?}", self.tile_width, self.center)?;
        writeln!(t, "  samples a texel     {}", self.samples_a_texel)?;
        writeln!(t, "  channels            {}, {}", self.channels.join(", "), self.quality)?;
        for l in &self.levels {
            let [w, h] = l.page;
            let size = output::bytes(l.bytes);
            writeln!(t, "  {:>4}² texels        {} page(s) of {w}×{h}, {size}", l.texels, l.pages)?;
        }
        Ok(())
    }
}

pub(crate) fn run(args: &Args) -> Result<()> {
    if args.presets {
        let all: String = Preset::ALL.iter().map(|p| p.text()).collect();
        return Ok(output::print(&all)?);
    }
    let path = args.pack.as_deref().context("no pack")?;
    let report = Report::of(&Pack::open(path)?)?;
    let text = if args.json {
        format!("{}\n", serde_json::to_string_pretty(&report)?)
    } else {
        report.text()?
    };
    Ok(output::print(&text)?)
}

impl Report {
    fn of(pack: &Pack) -> Result<Self> {
        let meta: Meta = header::decode(pack, SectionId::new(kind::META, 0))?;
        let sources = meta
            .sources
            .into_iter()
            .map(|s| SourceReport { name: s.name, hash: hex(&s.hash), placement: s.placement })
            .collect();
        let sections = pack
            .sections()
            .map(|(id, s)| SectionReport {
                name: kind::name(id.kind),
                index: id.index,
                codec: match s.codec {
                    Codec::None => "none",
                    Codec::Zstd => "zstd",
                },
                stored_bytes: s.stored_length,
                bytes: s.length,
            })
            .collect();
        let points = if PointsBlock::is_in(pack) {
            Some(PointsReport::of(&PointsBlock::open(pack)?))
        } else {
            None
        };
        Ok(Self {
            schema: "forest-bake/inspect/1",
            file: pack.path().into(),
            bytes: pack.file_length(),
            generator: meta.generator,
            options: meta.options,
            source_hash: hex(&meta.source_hash),
            sources,
            sections,
            points,
            views: if ViewsBlock::is_in(pack) {
                Some(ViewsReport::of(&ViewsBlock::open(pack)?))
            } else {
                None
            },
            foliage: if FoliageBlock::is_in(pack) {
                Some(FoliageReport::of(&FoliageBlock::open(pack)?))
            } else {
                None
            },
            volume: if VolumeBlock::is_in(pack) {
                Some(VolumeReport::of(&VolumeBlock::open(pack)?))
            } else {
                None
            },
            measures: Measures::read(pack)?,
        })
    }

    fn text(&self) -> Result<String, std::fmt::Error> {
        let mut t = String::new();
        writeln!(
            t,
            "{}: {}, by {}",
            self.file.display(),
            output::bytes(self.bytes),
            self.generator
        )?;
        writeln!(t, "source {}", self.source_hash)?;
        for s in &self.sources {
            let at = if s.placement.is_empty() { "" } else { " at " };
            writeln!(t, "  {}{at}{}", s.name, s.placement)?;
        }
        if !self.options.is_empty() {
            writeln!(t, "baked with {}", self.options.join(" "))?;
        }
        if let Some(p) = &self.points {
            p.text(&mut t)?;
        }
        if let Some(v) = &self.views {
            v.text(&mut t)?;
        }
        if let Some(f) = &self.foliage {
            f.text(&mut t)?;
        }
        if let Some(v) = &self.volume {
            v.text(&mut t)?;
        }
        if let Some(m) = &self.measures {
            measures_text(m, &mut t)?;
        }
        writeln!(t, "sections")?;
        for s in &self.sections {
            let name = format!("{}[{}]", s.name, s.index);
            let stored = output::bytes(s.stored_bytes);
            let packed = if s.codec == "none" {
                String::new()
            } else {
                format!(" ({} of {})", s.codec, output::bytes(s.bytes))
            };
            writeln!(t, "  {name:<26} {stored:>12}{packed}")?;
        }
        Ok(t)
    }
}

/// A line a light, height and level: means over the bands of elevation, the worst of their errors.
fn measures_text(m: &Measures, t: &mut String) -> std::fmt::Result {
    writeln!(t, "measured: {}", m.method)?;
    writeln!(
        t,
        "  {:>6} {:>6} {:>13} {:>8} {:>11} {:>8} {:>8} {:>9}",
        "light", "height", "level", "k, px²", "primitives", "FLIP max", "RMSE max", "coverage"
    )?;
    let mut lines: BTreeMap<_, Vec<&Measure>> = BTreeMap::new();
    for r in &m.rows {
        // Positive floats sort as their bits do; tall pictures first.
        let height = Reverse(r.pixel_height.to_bits());
        let key = (r.representation, r.light as u8, height, r.level.map(f32::to_bits));
        lines.entry(key).or_default().push(r);
    }
    for same in lines.values() {
        let [first, second, third] = same[0].level;
        let (level, bias) = match same[0].representation {
            kind::VIEWS_HEADER => {
                let lookup = Lookup::ALL.get(second as usize).map_or("?", |l| l.name());
                (format!("{first}² {lookup}"), String::new())
            }
            kind::VOLUME_HEADER | kind::FOLIAGE_HEADER => (format!("level {first}"), String::new()),
            _ => (format!("s_m {first}"), third.to_string()),
        };
        let mean =
            |of: fn(&Measure) -> f32| same.iter().map(|r| of(r)).sum::<f32>() / same.len() as f32;
        let worst = |of: fn(&Measure) -> f32| same.iter().map(|r| of(r)).fold(0.0, f32::max);
        writeln!(
            t,
            "  {:>6} {:>6} {:>13} {:>8} {:>11} {:>8.4} {:>8.4} {:>8.1}%",
            format!("{:?}", same[0].light).to_lowercase(),
            same[0].pixel_height,
            level,
            bias,
            output::count(mean(|r| r.primitives) as u64),
            worst(|r| r.flip_worst),
            worst(|r| r.rmse_worst),
            100.0 * mean(|r| r.coverage)
        )?;
    }
    Ok(())
}

impl PointsReport {
    fn of(block: &PointsBlock) -> Self {
        let h = &block.header;
        let world = |v: [f64; 3]| block.to_world(v.into()).to_array();
        let scale = block.scale();
        let radii = block.points.iter().map(|p| p.own());
        let radius =
            |code: Option<forest_points::SizeCode>| code.map_or(0.0, |c| c.radius() * scale);
        Self {
            min: world(h.min),
            max: world(h.max),
            grid: h.grid,
            cells: block.cells.len() - 1,
            order: format!("{:?}", h.order).to_lowercase(),
            radius: format!("{:?}", h.radius).to_lowercase(),
            counts: h.counts,
            triangles: block.triangles.len(),
            surfel_size: h.surfel_size.is_finite().then_some(h.surfel_size * scale),
            alpha_tolerance: h.alpha_tolerance,
            position_error: 0.5 * f64::from(h.step_exponent).exp2() * scale,
            bytes_per_surfel: size_of_val(block.points) as f64 / h.counts.surfels.max(1) as f64,
            calibrated: block.calibration.is_some(),
            radius_range: [radius(radii.clone().min()), radius(radii.max())],
        }
    }

    fn text(&self, t: &mut String) -> std::fmt::Result {
        let [x, y, z] = self.grid;
        let c = &self.counts;
        let size: Vec<String> =
            self.min.iter().zip(&self.max).map(|(a, b)| format!("{:.3}", b - a)).collect();
        writeln!(t, "points")?;
        writeln!(t, "  box                 {} from {:.3?}", size.join(" × "), self.min)?;
        writeln!(t, "  grid                {x}×{y}×{z}, {} cells in use", self.cells)?;
        writeln!(t, "  radius, order       {}, {}", self.radius, self.order)?;
        writeln!(t, "  source triangles    {}", output::count(c.source_triangles))?;
        if let Some(dropped) = c.dropped() {
            writeln!(t, "  left out            {dropped}")?;
        }
        writeln!(
            t,
            "  surfels, points     {}, {}",
            output::count(c.surfels),
            output::count(c.points)
        )?;
        writeln!(t, "  triangles stored    {}", output::count(self.triangles as u64))?;
        match self.surfel_size {
            Some(s) => writeln!(
                t,
                "  surfel size         {s:.4}, alpha footprint within {}",
                self.alpha_tolerance
            )?,
            None => writeln!(t, "  surfel size         one a triangle")?,
        }
        let [finest, coarsest] = self.radius_range;
        writeln!(t, "  radii               {finest:.5} to {coarsest:.3}")?;
        writeln!(t, "  position error      {:.1e} at most", self.position_error)?;
        writeln!(t, "  bytes per surfel    {:.1} (all levels)", self.bytes_per_surfel)
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}
