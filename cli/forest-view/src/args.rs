//! The command line.

use clap::{Parser, ValueEnum};
use forest_foliage::Wind;
use forest_raster::Light;
use forest_views::Lookup;
use forest_volume::Blending;
use std::path::PathBuf;

/// Shows LOD packs of trees: in a window, or as a picture without one.
///
/// Exit codes: 0 ok, 1 wrong usage, 2 input or output failed, 3 invalid input, 4 failed while
/// working (no graphics adapter, say), 5 the input needs something that is not supported.
#[derive(Parser, Debug)]
#[command(name = "forest-view", version, max_term_width = 100)]
pub(crate) struct Args {
    /// Pack to show, or scene file (.toml) of a landscape.
    #[arg(value_name = "PACK", required_unless_present = "list_adapters")]
    pub(crate) pack: Option<PathBuf>,
    /// Draw one picture, without a window.
    #[arg(long, requires = "output")]
    pub(crate) headless: bool,
    /// PNG to write, or the folder of a --sequence.
    #[arg(short, long, value_name = "PNG", requires = "headless")]
    pub(crate) output: Option<PathBuf>,
    /// Width and height in pixels.
    #[arg(long, default_value = "1280x720", value_name = "WxH", value_parser = size)]
    pub(crate) size: [u32; 2],
    /// front, back, left, right, top, diagonal, or YAW,PITCH in degrees: where the camera stands.
    #[arg(long, default_value = "front", value_name = "VIEW", allow_hyphen_values = true)]
    pub(crate) view: String,
    /// Camera of a scene file, by its name; default: its first one.
    #[arg(long, value_name = "NAME")]
    pub(crate) camera: Option<String>,
    /// Distance of the camera in half diagonals of the tree's box; default: as near as shows all of it.
    /// The picture is 40 degrees high.
    #[arg(long, value_name = "RADII", value_parser = positive)]
    pub(crate) distance: Option<f64>,
    /// Parallel camera, as that of `forest-bake draw`; without a window.
    #[arg(long, conflicts_with = "distance", requires = "headless")]
    pub(crate) parallel: bool,
    /// What to draw; default: auto if the pack has a measured table, else points, views, a
    /// volume or foliage.
    #[arg(long = "as", value_enum, value_name = "WHAT")]
    pub(crate) what: Option<Representation>,
    /// s_m, smallest projected area of a point in square pixels; default: 1, of scenes 4.
    #[arg(long, value_name = "PX2", value_parser = positive)]
    pub(crate) finest: Option<f64>,
    /// s_M, largest projected area of a point: larger ones are drawn as triangles. Default: 16 times
    /// s_m.
    #[arg(long, value_name = "PX2", value_parser = not_negative)]
    pub(crate) largest: Option<f64>,
    /// k, added to both at the back of the block and taken from them at its front.
    #[arg(long, default_value_t = 0.0, value_name = "PX2", allow_hyphen_values = true)]
    pub(crate) bias: f64,
    /// Scenes: power of the share of a tree that is seen by which --finest grows where the rest is
    /// hidden; 0 draws what is hidden as finely as what is seen.
    #[arg(long, default_value_t = 2.0 / 3.0, value_name = "POWER", value_parser = not_negative)]
    pub(crate) hidden: f64,
    /// Scenes: what is estimated to be seen less of than this share, for the trees before it, is left out;
    /// 0 leaves out only what is surely covered.
    #[arg(long, default_value_t = 1.0 / 64.0, value_name = "SHARE", value_parser = not_negative)]
    pub(crate) least_seen: f64,
    /// Scenes: far trees are drawn by views up to so many times the size at which they are as fine as
    /// points; 0 for points alone.
    #[arg(long, default_value_t = 1.0, value_name = "TIMES", value_parser = not_negative)]
    pub(crate) impostors: f64,
    /// How views are looked up.
    #[arg(long, value_enum, default_value = "depth")]
    pub(crate) lookup: LookupArg,
    /// Level of a volume, 0 is the root, or of foliage, 0 is the finest. Default: by --texel.
    #[arg(long, value_name = "N")]
    pub(crate) level: Option<u32>,
    /// How the billboards of a volume's two nearest cameras make one.
    #[arg(long, value_enum, default_value = "shares")]
    pub(crate) blend: BlendArg,
    /// Largest width of a texel in pixels: what chooses the level of views and foliage, and cells of a
    /// volume.
    #[arg(long, default_value_t = 1.0, value_name = "PX", value_parser = positive)]
    pub(crate) texel: f64,
    /// auto: the cheapest level of all representations whose FLIP error is at most this in all
    /// measured views; default: 0.05. Scenes: the coarsest points that are so good.
    #[arg(long, value_name = "FLIP", value_parser = positive32)]
    pub(crate) error: Option<f32>,
    /// auto: the best level that so many pictures a second leave time for. Scenes: points as coarse as
    /// that asks for.
    #[arg(long, value_name = "N", conflicts_with = "error", value_parser = positive)]
    pub(crate) fps: Option<f64>,
    /// Wind: its strength (0 calm, 1 a gale), or STRENGTH,SECONDS at a moment. Default: 0, of sequences
    /// 0.6.
    #[arg(long, value_name = "WIND")]
    pub(crate) wind: Option<Wind>,
    /// Draw pictures over so many seconds of wind into the folder --output, with an animated preview.
    #[arg(long, value_name = "SECONDS", requires = "headless", value_parser = positive)]
    #[arg(conflicts_with_all = ["truth", "fps"])]
    pub(crate) sequence: Option<f64>,
    /// Pictures a second of --sequence.
    #[arg(long, default_value_t = 20, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=240))]
    pub(crate) rate: u16,
    /// Light: a sun with shadows on foliage, and by its crown on all else in a pack with foliage; none
    /// in others.
    #[arg(long, value_enum, default_value = "sun")]
    pub(crate) light: LightArg,
    /// L_m over L_M of the estimated self-shadow: the share of the sun at the side of the tree that is
    /// farthest from it.
    #[arg(long, default_value_t = 1.0, value_name = "SHARE", value_parser = share)]
    pub(crate) self_shadow: f32,
    /// Samples a side of a pixel.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=8))]
    pub(crate) samples: u32,
    /// Straight alpha instead of a grey background.
    #[arg(long, requires = "headless")]
    pub(crate) alpha: bool,
    /// The tree that the pack was baked from (.glb, .gltf, .obj): drawn on the left of the picture.
    #[arg(long, value_name = "TREE")]
    pub(crate) truth: Option<PathBuf>,
    /// Refuse a --truth of more triangles.
    #[arg(long, default_value_t = 50_000_000, value_name = "N", requires = "truth")]
    pub(crate) max_triangles: u64,
    /// Measure pictures along the camera path of this file, or of a scene file along its path of this
    /// name, instead of showing one.
    #[arg(long, value_name = "PATH", requires = "json")]
    #[arg(conflicts_with_all = ["headless", "truth", "screenshot"])]
    pub(crate) bench: Option<PathBuf>,
    /// Where --bench writes its figures.
    #[arg(long, value_name = "JSON", requires = "bench")]
    pub(crate) json: Option<PathBuf>,
    /// Use the first adapter whose description contains this.
    #[arg(long, value_name = "TEXT")]
    pub(crate) adapter: Option<String>,
    /// List the graphics adapters, the best first.
    #[arg(long)]
    pub(crate) list_adapters: bool,
    /// Write the window's picture here once it stands, then quit: for tests and manuals.
    #[arg(long, value_name = "PNG", conflicts_with = "headless")]
    pub(crate) screenshot: Option<PathBuf>,
    /// Say nothing but errors.
    #[arg(short, long)]
    pub(crate) quiet: bool,
}

/// What to draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Representation {
    /// Whatever is cheapest and good enough, by the pack's measured table.
    Auto,
    /// Points, and triangles near the camera.
    Points,
    /// Views.
    Views,
    /// Billboards of an octree, in the light of their photographs.
    Volume,
    /// Cards of leaves, sheets of twigs, tubes of branches; bent by the wind.
    Foliage,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum LookupArg {
    /// The nearest view.
    Nearest,
    /// The three views around, by their shares.
    Blend,
    /// The three views around, followed through their depth.
    Depth,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum BlendArg {
    /// Their mean; what one does not know is the other's.
    Shares,
    /// One over the other: the paper's way.
    Over,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum LightArg {
    /// Base colours.
    Albedo,
    /// A sun from the left, and light from everywhere.
    Sun,
}

impl From<LookupArg> for Lookup {
    fn from(l: LookupArg) -> Self {
        match l {
            LookupArg::Nearest => Self::Nearest,
            LookupArg::Blend => Self::Blend,
            LookupArg::Depth => Self::Depth,
        }
    }
}

impl From<BlendArg> for Blending {
    fn from(b: BlendArg) -> Self {
        match b {
            BlendArg::Shares => Self::Shares,
            BlendArg::Over => Self::Over,
        }
    }
}

impl LightArg {
    pub(crate) fn light(self, darkest: f32) -> Light {
        match (self, Light::MORNING) {
            (Self::Albedo, _) => Light::Albedo,
            (Self::Sun, Light::Sun(sun)) => Light::Sun(forest_raster::Sun { darkest, ..sun }),
            (Self::Sun, other) => other,
        }
    }
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let sides =
        text.split_once(['x', 'X']).and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    let size = sides.ok_or("not WIDTHxHEIGHT")?;
    match size.iter().all(|n| (1..=16384).contains(n)) {
        true => Ok(size),
        false => Err("sides must be within 1 and 16384".into()),
    }
}

fn number(text: &str) -> Result<f64, String> {
    let value: f64 = text.parse().map_err(|_| "not a number".to_string())?;
    if value.is_nan() { Err("not a number".into()) } else { Ok(value) }
}

fn positive(text: &str) -> Result<f64, String> {
    match number(text)? {
        v if v > 0.0 && v.is_finite() => Ok(v),
        _ => Err("it must be above 0".into()),
    }
}

fn positive32(text: &str) -> Result<f32, String> {
    positive(text).map(|v| v as f32)
}

fn not_negative(text: &str) -> Result<f64, String> {
    let v = number(text)?;
    if v >= 0.0 { Ok(v) } else { Err("it must not be negative".into()) }
}

fn share(text: &str) -> Result<f32, String> {
    match number(text)? {
        v if (0.0..=1.0).contains(&v) => Ok(v as f32),
        _ => Err("it must be within 0 and 1".into()),
    }
}
