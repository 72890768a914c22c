//! `forest-bake foliage`.

use crate::log::Log;
use crate::output;
use crate::source::{LoadedSource, SourceArgs};
use crate::target;
use anyhow::Result;
use forest_foliage::{BakeReport, FoliageOptions, PartsOptions, WoodWay};
use forest_pack::{PackWriter, SectionId, header, kind};
use glam::DVec3;
use serde::Serialize;
use std::path::PathBuf;
use std::time::Instant;

#[derive(clap::Args)]
pub(crate) struct Args {
    #[command(flatten)]
    source: SourceArgs,
    /// Pack to write. An existing pack of the same source keeps its other representations.
    #[arg(short, long, value_name = "PACK")]
    output: PathBuf,
    /// Materials whose name contains this are leaves. Without it, textures, names and shapes decide.
    #[arg(long, value_name = "MATERIAL")]
    leaf: Vec<String>,
    /// Materials whose name contains this are wood.
    #[arg(long, value_name = "MATERIAL")]
    wood: Vec<String>,
    /// Number of levels; texels of each are twice as large as those of the one before.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=8))]
    levels: u32,
    /// Size of a texel of the finest level in world units. Default: 1/512 of the height.
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    texel: Option<f64>,
    /// Store the dictionary as RGBA instead of BC7 blocks.
    #[arg(long)]
    lossless: bool,
    /// Replace a pack of another source, or one with sections this version does not know.
    #[arg(long)]
    force: bool,
    /// Print counts, times and errors as JSON on stdout.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args, log: Log) -> Result<()> {
    args.check()?;
    let source = args.source.load(log)?;
    let summary = bake(args, &source, log)?;
    if args.json {
        output::print(&format!("{}\n", serde_json::to_string_pretty(&summary)?))?;
    }
    Ok(())
}

impl Args {
    /// Whether its options make sense.
    pub(crate) fn check(&self) -> Result<()> {
        self.options().map(|_| ())
    }

    fn options(&self) -> Result<FoliageOptions> {
        let parts = PartsOptions { leaf: self.leaf.clone(), wood: self.wood.clone() };
        let (texel, levels, blocks) = (self.texel, self.levels, !self.lossless);
        let options = FoliageOptions { parts, texel, levels, blocks };
        options.validate().map_err(crate::failure::Usage)?;
        Ok(options)
    }
}

/// Bakes what was read.
pub(crate) fn bake(args: &Args, source: &LoadedSource, log: Log) -> Result<Summary> {
    let start = Instant::now();
    let options = args.options()?;
    let kept = target::existing(&args.output, &source.meta, args.force)?;
    let mut writer = PackWriter::create(&args.output)?;
    header::write(&mut writer, SectionId::new(kind::META, 0), &source.meta)?;
    let bar = output::bar(u64::from(args.levels), "levels", log);
    let report =
        forest_foliage::bake(&source.soup, &options, &mut writer, &|n| bar.set_position(n))?;
    bar.finish_and_clear();
    if let Some(pack) = &kept {
        let own = |k| {
            (kind::FOLIAGE_HEADER..=kind::WIND_BRANCHES).contains(&k)
                || [kind::MATERIALS, kind::TEXTURE, kind::LIGHT_CROWN].contains(&k)
        };
        target::keep_others(&mut writer, pack, kind::FOLIAGE_HEADER, own)?;
    }
    writer.finish()?;
    target::tie(&args.output)?;
    let seconds = [source.seconds, source.seconds + start.elapsed().as_secs_f64()];
    let summary = Summary::new(args, &report, seconds)?;
    if log.says() {
        summary.tell();
    }
    Ok(summary)
}

/// What was done, for people and programs.
#[derive(Serialize)]
pub(crate) struct Summary {
    output: PathBuf,
    bytes: u64,
    materials: Vec<MaterialSummary>,
    /// Trunk, its branches, theirs, all others.
    branches: [u32; 4],
    /// Pieces of wood that did not hang together.
    pieces: usize,
    leaves: usize,
    /// Finest first.
    levels: Vec<LevelSummary>,
    /// Shares of the light that comes through the crown that the other representations of the pack show:
    /// of a sun behind the eye and of one against it, 45° high; and of the sky.
    light: [f32; 3],
    /// Texels across and down the dictionary, and the share that pictures fill.
    dictionary: [u32; 2],
    filled: f64,
    seconds: f64,
    import_seconds: f64,
    skeleton_seconds: f64,
    visibility_seconds: f64,
    levels_seconds: f64,
    light_seconds: f64,
    dictionary_seconds: f64,
}

#[derive(Serialize)]
struct MaterialSummary {
    name: String,
    triangles: usize,
    leaf_triangles: usize,
    coverage: f64,
    /// told, alpha, name or shape.
    because: &'static str,
}

#[derive(Serialize)]
struct LevelSummary {
    texel: f64,
    triangles: u64,
    tubes: u32,
    sheets: u32,
    cards: u32,
    /// Branches and groups that nobody sees.
    hidden: u32,
    /// tubes or simplified: the better at equal triangles.
    wood: &'static str,
    tube_errors: WoodSummary,
    simplified_errors: WoodSummary,
}

#[derive(Serialize)]
struct WoodSummary {
    triangles: usize,
    /// Root mean square distance of the surfaces, in world units.
    distance: f64,
    /// Root mean square difference of pictures.
    image: f64,
}

impl Summary {
    fn new(args: &Args, report: &BakeReport, [import, seconds]: [f64; 2]) -> Result<Self> {
        let wood = |e: forest_foliage::WoodErrors| WoodSummary {
            triangles: e.triangles,
            distance: e.distance,
            image: e.image,
        };
        let levels = report.header.levels.iter().zip(&report.wood);
        let [skeleton, visibility, making, light, dictionary] =
            report.times.map(|t| t.as_secs_f64());
        let to_sun = DVec3::new(0.0, 1.0, 1.0).normalize();
        let sunlit = |to_eye| report.light.sunlit(to_sun, to_eye);
        Ok(Self {
            light: [sunlit(to_sun), sunlit(-to_sun), report.light.skylit(DVec3::Z)],
            output: args.output.clone(),
            bytes: std::fs::metadata(&args.output)?.len(),
            materials: report
                .materials
                .iter()
                .map(|m| MaterialSummary {
                    name: m.name.clone(),
                    triangles: m.triangles,
                    leaf_triangles: m.leaf_triangles,
                    coverage: m.coverage,
                    because: m.reason.name(),
                })
                .collect(),
            branches: report.header.branches,
            pieces: report.pieces,
            leaves: report.leaves,
            levels: levels
                .map(|(l, [tubes, simplified])| LevelSummary {
                    texel: l.texel,
                    triangles: l.triangles(),
                    tubes: l.tubes,
                    sheets: l.sheets,
                    cards: l.cards,
                    hidden: l.hidden,
                    wood: match l.wood {
                        WoodWay::Tubes => "tubes",
                        WoodWay::Simplified => "simplified",
                    },
                    tube_errors: wood(*tubes),
                    simplified_errors: wood(*simplified),
                })
                .collect(),
            dictionary: report.header.atlas,
            filled: report.filled,
            seconds,
            import_seconds: import,
            skeleton_seconds: skeleton,
            visibility_seconds: visibility,
            levels_seconds: making,
            light_seconds: light,
            dictionary_seconds: dictionary,
        })
    }

    fn tell(&self) {
        for m in &self.materials {
            let what = match m.leaf_triangles {
                0 => "wood".into(),
                n if n == m.triangles => "leaves".into(),
                n => format!("leaves in {} triangles, else wood", output::count(n as u64)),
            };
            eprintln!(
                "{:?}: {} triangles, {what} (by {}; covers {:.0} %)",
                m.name,
                output::count(m.triangles as u64),
                m.because,
                100.0 * m.coverage
            );
        }
        let [trunk, first, second, more] = self.branches;
        eprintln!(
            "skeleton: trunk {trunk}, branches {first}, of them {second}, further {more}; {} pieces of \
             wood, {} leaves",
            output::count(self.pieces as u64),
            output::count(self.leaves as u64)
        );
        for (i, l) in self.levels.iter().enumerate() {
            eprintln!(
                "level {i}: texel {:.4}, {} triangles: {} tubes ({}; image error {:.4}, simplified \
                 {:.4}), {} sheets, {} cards, {} hidden",
                l.texel,
                output::count(l.triangles),
                l.tubes,
                l.wood,
                l.tube_errors.image,
                l.simplified_errors.image,
                l.sheets,
                l.cards,
                l.hidden
            );
        }
        let [behind, against, sky] = self.light.map(|share| 100.0 * share);
        eprintln!(
            "light: of what comes through the crown, points, views and volumes of this pack show {behind:.0} % of \
             a sun behind the eye, {against:.0} % of one against it, {sky:.0} % of the sky"
        );
        let [w, h] = self.dictionary;
        eprintln!(
            "{}: dictionary {w} × {h}, {:.0} % filled, {}, {:.2} s",
            self.output.display(),
            100.0 * self.filled,
            output::bytes(self.bytes),
            self.seconds
        );
    }
}
