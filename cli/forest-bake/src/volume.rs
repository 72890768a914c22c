//! `forest-bake volume`.

use crate::failure::Usage;
use crate::log::Log;
use crate::output;
use crate::source::{ImportArgs, LoadedSource, meta};
use crate::target;
use anyhow::Result;
use forest_eval::{MatteErrors, can_judge, hold_out, matte_errors};
use forest_import::{Up, load_photographs};
use forest_pack::header::{self, Source};
use forest_pack::{Pack, PackWriter, SectionId, kind};
use forest_raster::Surfaces;
use forest_soup::Photograph;
use forest_volume::{
    BakeReport, Blank, Branching, Coarse, CodebookOptions, CodebookSize, Coding, Prune, Space,
    Stand, TomographyOptions, Volume, VolumeBlock, VolumeOptions,
};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

#[derive(clap::Args)]
pub(crate) struct Args {
    /// Trees, as `points` takes them; or one capture: a folder with a transforms.json as NeRF tools
    /// write it, or that file, and RGBA images whose alpha is the tree's matte.
    #[arg(required = true, value_name = "SOURCE")]
    source: Vec<String>,
    #[command(flatten)]
    import: ImportArgs,
    /// Pack to write. An existing pack of the same source keeps its other representations.
    #[arg(short, long, value_name = "PACK")]
    output: PathBuf,
    #[command(flatten)]
    mesh: MeshArgs,
    #[command(flatten)]
    capture: CaptureArgs,
    /// Into how many parts cells are cut: 8, or 27.
    #[arg(long, value_enum, default_value = "octree")]
    branching: BranchingArg,
    /// Levels below the root. Default: 7 of an octree, 5 of a tri-grid.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=8))]
    levels: Option<u32>,
    /// Texels along the side of a billboard: 2, 4 or 8.
    #[arg(long, default_value_t = 4, value_name = "N")]
    texels: u32,
    /// A cell has no billboard for a camera from which more than this share of it is hidden; 1
    /// keeps all.
    #[arg(long, default_value_t = 0.98, value_name = "SHARE", allow_hyphen_values = true)]
    prune: f64,
    /// From where a cell must be hidden: from the camera and its neighbours, or from the camera
    /// alone, as in the paper.
    #[arg(long, value_enum, default_value = "neighbours")]
    prune_by: PruneArg,
    /// Where the textures of coarser levels come from.
    #[arg(long, value_enum, default_value = "photographs")]
    coarse: CoarseArg,
    #[command(flatten)]
    codebook: CodebookArgs,
    /// Replace a pack of another source, or one with sections this version does not know.
    #[arg(long)]
    force: bool,
    /// Print counts, times and errors as JSON on stdout.
    #[arg(long)]
    json: bool,
}

/// For trees that are not photographed yet.
#[derive(clap::Args)]
struct MeshArgs {
    /// Number of cameras around a mesh.
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=256))]
    cameras: u32,
    /// Where they stand: dome (from the horizon up), ring, or ring:DEGREES above the horizon.
    #[arg(long, default_value = "dome", value_name = "STAND")]
    stand: String,
}

/// For captures.
#[derive(clap::Args)]
struct CaptureArgs {
    /// The axis of the capture's world that points up.
    #[arg(long, value_enum, default_value = "z")]
    up: UpArg,
    /// Rounds of the opacity estimate on each level.
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=1000))]
    rounds: u32,
    /// Leave out this many photographs, evenly, and judge the pack by them: without a lens'
    /// distortion, and with their axis in the middle.
    #[arg(long, default_value_t = 0, value_name = "N")]
    hold_out: u32,
}

#[derive(clap::Args)]
struct CodebookArgs {
    /// Codewords of colour and of alpha at most, or "none": texels are stored as they are.
    #[arg(long, default_value = "512", value_name = "N")]
    codebook: String,
    /// The smallest codebooks (16, 32, …) with at least this PSNR in dB, of colour and of alpha.
    #[arg(long, value_name = "DB", conflicts_with = "codebook", allow_hyphen_values = true)]
    psnr: Option<f64>,
    /// Colour space in which codewords are near or far.
    #[arg(long, value_enum, default_value = "lab")]
    space: SpaceArg,
    /// What codewords are.
    #[arg(long, value_enum, default_value = "nearest")]
    words: WordsArg,
    /// What blank texels hold while codebooks are trained.
    #[arg(long, value_enum, default_value = "mean")]
    blank: BlankArg,
    /// Compress the atlas of codewords by BC3 (DXT5).
    #[arg(long)]
    bc3: bool,
    /// Names the draw of the first codewords.
    #[arg(long, default_value_t = 1, value_name = "N")]
    seed: u64,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum BranchingArg {
    /// 2 × 2 × 2.
    Octree,
    /// 3 × 3 × 3, which the paper compares with.
    TriGrid,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum PruneArg {
    /// The camera alone: viewers beside it see holes.
    Own,
    /// The camera and those around it.
    Neighbours,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum CoarseArg {
    /// The photographs, as those of the finest level.
    Photographs,
    /// The level below, averaged.
    Below,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum UpArg {
    /// y, as in glTF.
    Y,
    /// z, as NeRF tools have it.
    Z,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum SpaceArg {
    /// CIELab.
    Lab,
    /// sRGB.
    Rgb,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum WordsArg {
    /// Billboards of the tree: nothing is averaged.
    Nearest,
    /// Means: the plain generalised Lloyd algorithm.
    Mean,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum BlankArg {
    /// Their billboard's mean colour.
    Mean,
    /// Black, filled in codewords by their brightest colour: the paper's rule.
    Black,
}

/// The cameras that `text` names.
pub(crate) fn stand(text: &str, cameras: u32) -> Result<Stand> {
    let wrong = || Usage(format!("--stand {text:?}: dome, ring, or ring:DEGREES from −90 to 90"));
    Ok(match text.split_once(':') {
        None if text == "dome" => Stand::Dome { cameras },
        None if text == "ring" => Stand::Ring { cameras, elevation: 10.0 },
        Some(("ring", degrees)) => {
            let elevation: f64 = degrees.parse().map_err(|_| wrong())?;
            if !(-90.0..=90.0).contains(&elevation) {
                return Err(wrong().into());
            }
            Stand::Ring { cameras, elevation }
        }
        _ => return Err(wrong().into()),
    })
}

/// What a volume is made of.
pub(crate) enum Loaded {
    Mesh(Box<LoadedSource>),
    Capture(Box<LoadedCapture>),
}

/// Photographs.
pub(crate) struct LoadedCapture {
    photographs: Vec<Photograph>,
    held_out: Vec<Photograph>,
    meta: header::Meta,
    /// Time of reading.
    seconds: f64,
}

impl Loaded {
    /// What the pack will say of its source.
    pub(crate) fn meta_mut(&mut self) -> &mut header::Meta {
        match self {
            Self::Mesh(mesh) => &mut mesh.meta,
            Self::Capture(capture) => &mut capture.meta,
        }
    }

    fn seconds(&self) -> f64 {
        match self {
            Self::Mesh(mesh) => mesh.seconds,
            Self::Capture(capture) => capture.seconds,
        }
    }
}

/// Whether a source is a capture, not a tree.
pub(crate) fn is_capture(source: &str) -> bool {
    let path = Path::new(source);
    path.is_dir() || path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json"))
}

pub(crate) fn run(args: &Args, log: Log) -> Result<()> {
    args.check()?;
    let source = args.load(log)?;
    let summary = bake(args, &source, log)?;
    if args.json {
        output::print(&format!("{}\n", serde_json::to_string_pretty(&summary)?))?;
    }
    Ok(())
}

/// Bakes what was read.
pub(crate) fn bake(args: &Args, source: &Loaded, log: Log) -> Result<Summary> {
    let start = Instant::now();
    let options = args.options()?;
    let codebook = args.codebook.options()?;
    let stand = stand(&args.mesh.stand, args.mesh.cameras)?;
    let import = source.seconds();
    let meta = match source {
        Loaded::Mesh(mesh) => &mesh.meta,
        Loaded::Capture(capture) => &capture.meta,
    };
    let kept = target::existing(&args.output, meta, args.force)?;
    let (volume, held_out) = match source {
        Loaded::Mesh(mesh) => {
            let surfaces = Surfaces::new(&mesh.soup.materials, &mesh.soup.textures);
            let bar = output::bar(stand.directions().len() as u64, "cameras", log);
            let tell = |n| bar.set_position(n);
            let volume = Volume::from_mesh(&mesh.soup, &surfaces, stand, &options, &tell)?;
            bar.finish_and_clear();
            (volume, &[][..])
        }
        Loaded::Capture(capture) => {
            let LoadedCapture { photographs, held_out, .. } = &**capture;
            let tomography =
                TomographyOptions { rounds: args.capture.rounds, ..TomographyOptions::default() };
            // Rounds on every level but the first three, and billboards.
            let rounds = options.levels.saturating_sub(2) * args.capture.rounds;
            let steps = u64::from(rounds) + photographs.len() as u64;
            let bar = output::bar(steps, "rounds and cameras", log);
            let tell = |n| bar.set_position(n);
            let volume = Volume::from_photographs(photographs, &tomography, &options, &tell)?;
            bar.finish_and_clear();
            warn(photographs, &volume, &options, log);
            (volume, &held_out[..])
        }
    };
    let mut writer = PackWriter::create(&args.output)?;
    header::write(&mut writer, SectionId::new(kind::META, 0), meta)?;
    let report = forest_volume::bake(&volume, codebook.as_ref(), &mut writer)?;
    if let Some(pack) = &kept {
        let own = |kind| (kind::VOLUME_HEADER..=kind::VOLUME_ATLAS).contains(&kind);
        target::keep_others(&mut writer, pack, kind::VOLUME_HEADER, own)?;
    }
    writer.finish()?;
    let judged = judge(&args.output, held_out)?;
    let seconds = [import, import + start.elapsed().as_secs_f64()];
    let summary = Summary::new(args, &volume, &report, judged, seconds)?;
    if log.says() {
        summary.tell();
    }
    Ok(summary)
}

/// The pack beside photographs that it does not know; `None` without any.
fn judge(pack: &Path, held_out: &[Photograph]) -> Result<Option<MatteErrors>> {
    if held_out.is_empty() {
        return Ok(None);
    }
    let pack = Pack::open(pack)?;
    let block = VolumeBlock::open(&pack)?;
    Ok(Some(matte_errors(&block, held_out)?))
}

/// Times the median residual from which a photograph is suspected, and the least one.
const SUSPECT: f64 = 2.5;
const SUSPECT_LEAST: f64 = 0.1;

/// Median residual from which all of them are suspected.
const SUSPECT_ALL: f64 = 0.25;

/// Says what is odd about a capture.
fn warn(photographs: &[Photograph], volume: &Volume, options: &VolumeOptions, log: Log) {
    if volume.lattice.levels < options.levels {
        let (have, want) = (volume.lattice.levels, options.levels);
        log.warn(format!("the photographs' pixels hold {have} levels, not {want}"));
    }
    let Some(found) = &volume.report.tomography else { return };
    let mut sorted = found.residuals.clone();
    sorted.sort_by(f64::total_cmp);
    let median = sorted[sorted.len() / 2];
    if median > SUSPECT_ALL {
        log.warn(format!(
            "the mattes do not fit each other (median RMS {median:.3}; above {SUSPECT_ALL}): are \
             poses and focal lengths right?"
        ));
    }
    let limit = (SUSPECT * median).max(SUSPECT_LEAST);
    for (photo, residual) in photographs.iter().zip(&found.residuals) {
        if *residual > limit {
            log.warn(format!(
                "{}: its matte is off by {residual:.3} (RMS; above {limit:.3}): is its pose right?",
                photo.name
            ));
        }
    }
}

impl Args {
    /// Whether its options make sense.
    pub(crate) fn check(&self) -> Result<()> {
        self.options()?;
        self.codebook.options()?;
        stand(&self.mesh.stand, self.mesh.cameras).map(|_| ())
    }

    pub(crate) fn load(&self, log: Log) -> Result<Loaded> {
        let start = Instant::now();
        let [capture] = &self.source[..] else {
            if let Some(capture) = self.source.iter().find(|s| is_capture(s)) {
                let problem = "a capture cannot be baked together with others";
                return Err(Usage(format!("{capture}: {problem}")).into());
            }
            return Ok(Loaded::Mesh(Box::new(self.import.load(&self.source, log)?)));
        };
        if !is_capture(capture) {
            return Ok(Loaded::Mesh(Box::new(self.import.load(&self.source, log)?)));
        }
        let up = match self.capture.up {
            UpArg::Y => Up::Y,
            UpArg::Z => Up::Z,
        };
        let set = load_photographs(Path::new(capture), &self.import.limits(), up)?;
        set.warnings.iter().for_each(|w| log.warn(w));
        let count = set.photographs.len();
        if self.capture.hold_out as usize >= count {
            let n = self.capture.hold_out;
            return Err(Usage(format!("--hold-out {n}: there are {count} photographs")).into());
        }
        let (photographs, held_out) = hold_out(set.photographs, self.capture.hold_out as usize);
        // Before the work, not after.
        held_out.iter().try_for_each(can_judge)?;
        let name = Path::new(capture).file_name().unwrap_or_default().to_string_lossy();
        let placement = match held_out.len() {
            0 => String::new(),
            n => format!("without {n} photographs"),
        };
        let source = Source { name: name.into_owned(), hash: set.hash, placement };
        let (meta, seconds) = (meta(vec![source]), start.elapsed().as_secs_f64());
        Ok(Loaded::Capture(Box::new(LoadedCapture { photographs, held_out, meta, seconds })))
    }

    fn options(&self) -> Result<VolumeOptions> {
        let branching = match self.branching {
            BranchingArg::Octree => Branching::Octree,
            BranchingArg::TriGrid => Branching::TriGrid,
        };
        let options = VolumeOptions {
            branching,
            levels: self.levels.unwrap_or(branching.usual_levels()),
            texels: self.texels,
            prune: self.prune,
            prune_by: match self.prune_by {
                PruneArg::Own => Prune::Own,
                PruneArg::Neighbours => Prune::Neighbours,
            },
            coarse: match self.coarse {
                CoarseArg::Photographs => Coarse::Photographs,
                CoarseArg::Below => Coarse::Below,
            },
        };
        options.validate().map_err(Usage)?;
        Ok(options)
    }
}

impl CodebookArgs {
    fn options(&self) -> Result<Option<CodebookOptions>> {
        let size = match (self.psnr, self.codebook.as_str()) {
            (Some(db), _) => CodebookSize::Psnr(db),
            (None, "none") => return Ok(None),
            (None, text) => CodebookSize::Words(text.parse().map_err(|_| {
                Usage(format!("--codebook {text:?}: a number of codewords, or \"none\""))
            })?),
        };
        let options = CodebookOptions {
            size,
            space: match self.space {
                SpaceArg::Lab => Space::Lab,
                SpaceArg::Rgb => Space::Rgb,
            },
            centers: match self.words {
                WordsArg::Nearest => forest_volume::Centers::Nearest,
                WordsArg::Mean => forest_volume::Centers::Mean,
            },
            blank: match self.blank {
                BlankArg::Mean => Blank::Mean,
                BlankArg::Black => Blank::Black,
            },
            seed: self.seed,
            block: self.bc3,
        };
        options.validate().map_err(Usage)?;
        Ok(Some(options))
    }
}

/// What was done, for people and programs.
#[derive(Serialize)]
pub(crate) struct Summary {
    output: PathBuf,
    bytes: u64,
    cameras: usize,
    texels: u32,
    /// From the root down.
    levels: Vec<LevelSummary>,
    /// Billboards of all levels and cameras.
    billboards: u64,
    /// Bytes of their texels, four each.
    raw_bytes: u64,
    /// Bytes of what is stored of them: numbers of codewords and the atlas.
    texture_bytes: u64,
    /// Bytes of nodes and camera masks.
    node_bytes: u64,
    color_codewords: Option<u32>,
    alpha_codewords: Option<u32>,
    /// PSNR of the codebooks, in dB: of sRGB, and of alpha; null if nothing is lost.
    color_psnr: Option<f64>,
    alpha_psnr: Option<f64>,
    /// Mean CIELab difference.
    delta_e: Option<f64>,
    /// Errors in photographs that the bake did not know.
    held_out: Option<MatteErrors>,
    seconds: f64,
    import_seconds: f64,
    /// Photographing a mesh.
    photograph_seconds: f64,
    /// Measuring or estimating opacity.
    opacity_seconds: f64,
    /// Making billboards, summed over threads: of the finest level, and of all others.
    billboard_seconds: [f64; 2],
    /// Training codebooks and writing.
    encode_seconds: f64,
}

#[derive(Serialize)]
struct LevelSummary {
    /// Cells that hold something.
    cells: u64,
    /// Billboards before pruning: cells times cameras.
    pairs: u64,
    /// Of these, hidden from their camera.
    hidden: u64,
    /// Of these, not hidden, but without anything to show.
    blank: u64,
    /// What is left.
    billboards: u32,
}

impl Summary {
    fn new(
        args: &Args,
        volume: &Volume,
        r: &BakeReport,
        held_out: Option<MatteErrors>,
        [import, all]: [f64; 2],
    ) -> Result<Self> {
        let words = match r.header.coding {
            Coding::Texels => [None; 2],
            Coding::Codebook { colors, alphas, .. } => [Some(colors), Some(alphas)],
        };
        let v = &volume.report;
        let levels = v.levels.iter().zip(&r.header.levels).map(|(l, h)| LevelSummary {
            cells: l.cells,
            pairs: l.pairs,
            hidden: l.hidden,
            blank: l.blank,
            billboards: h.billboards,
        });
        let finite = |v: f64| v.is_finite().then_some(v);
        Ok(Self {
            output: args.output.clone(),
            bytes: std::fs::metadata(&args.output)?.len(),
            cameras: r.header.cameras.len(),
            texels: r.header.texels,
            levels: levels.collect(),
            billboards: volume.billboards(),
            raw_bytes: r.raw_bytes,
            texture_bytes: r.texture_bytes,
            node_bytes: r.node_bytes,
            color_codewords: words[0],
            alpha_codewords: words[1],
            color_psnr: r.quality.and_then(|q| finite(q.color_psnr)),
            alpha_psnr: r.quality.and_then(|q| finite(q.alpha_psnr)),
            delta_e: r.quality.map(|q| q.delta_e),
            held_out,
            seconds: all,
            import_seconds: import,
            photograph_seconds: v.photographs.as_secs_f64(),
            opacity_seconds: v.opacity.as_secs_f64(),
            billboard_seconds: v.billboards.map(|t| t.as_secs_f64()),
            encode_seconds: r.encode.as_secs_f64(),
        })
    }

    fn tell(&self) {
        let finest = self.levels.last().expect("a root");
        eprintln!(
            "{}: {} levels, {} cells on the finest, {} cameras, {} billboards of {}² texels: {:.2} s \
             (photographs {:.2}, opacity {:.2}, encode {:.2})",
            self.output.display(),
            self.levels.len(),
            output::count(finest.cells),
            self.cameras,
            output::count(self.billboards),
            self.texels,
            self.seconds,
            self.photograph_seconds,
            self.opacity_seconds,
            self.encode_seconds,
        );
        let share = |n: u64| 100.0 * n as f64 / finest.pairs.max(1) as f64;
        eprintln!(
            "finest level: {:.1} % of {} billboards are hidden, {:.1} % blank; textures {} of {}, \
             nodes {}",
            share(finest.hidden),
            output::count(finest.pairs),
            share(finest.blank),
            output::bytes(self.texture_bytes),
            output::bytes(self.raw_bytes),
            output::bytes(self.node_bytes),
        );
        if let (Some(colors), Some(alphas)) = (self.color_codewords, self.alpha_codewords) {
            let db = |v: Option<f64>| v.map_or("lossless".into(), |v| format!("{v:.2} dB"));
            eprintln!(
                "codebooks: {colors} colours {}, {alphas} alphas {}, mean ΔE {:.2}",
                db(self.color_psnr),
                db(self.alpha_psnr),
                self.delta_e.unwrap_or(0.0),
            );
        }
        if let Some(e) = &self.held_out {
            eprintln!(
                "{} photographs held out: RMSE of mattes {:.4}, IoU {:.3}, RMSE of colour and matte {:.4}",
                e.photographs, e.matte_rmse, e.iou, e.rmse
            );
        }
    }
}
