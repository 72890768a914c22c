//! The shaders: WGSL files put together, with the constants of the crates whose rules they follow.

use crate::CHUNK;
use crate::landscape;
use forest_foliage::Gain;
use forest_foliage::wind::{ALONG_STEPS, STEADY, SWINGS};
use forest_points::{SizeCode, spheroid};
use forest_views as views;
use wgpu::{Device, ShaderModule, ShaderModuleDescriptor, ShaderSource};

const COMMON: &str = include_str!("wgsl/common.wgsl");
const CELL: &str = include_str!("wgsl/cell.wgsl");
const WIND: &str = include_str!("wgsl/wind.wgsl");
const BEND: &str = include_str!("wgsl/bend.wgsl");
const POINTS: &str = include_str!("wgsl/points.wgsl");
const LIT_BLOCK: &str = include_str!("wgsl/lit_block.wgsl");
const CHUNK_OF: &str = include_str!("wgsl/chunk.wgsl");
const LARGE_LIST: &str = include_str!("wgsl/large_list.wgsl");
const SPLAT_BOX: &str = include_str!("wgsl/splat_box.wgsl");
const KEEP64: &str = include_str!("wgsl/keep64.wgsl");
const KEEP32: &str = include_str!("wgsl/keep32.wgsl");
const LARGE: &str = include_str!("wgsl/points_large.wgsl");
const TILE: &str = include_str!("wgsl/tile.wgsl");
const SURFACE: &str = include_str!("wgsl/surface.wgsl");
const TRIANGLES: &str = include_str!("wgsl/triangles.wgsl");

/// Names the share of samples that fading layers draw, among the uses of the hash rule.
const FADE: u32 = 0x6661_6465;

/// The shaders of all passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shader {
    /// Small points, with 64-bit atomics.
    Splat64,
    /// Small points, without them.
    Splat32,
    /// Large points, and what the splats found.
    Points,
    Triangles,
    Foliage,
    Views,
    Volume,
    Present,
    Landscape(Step),
}

/// The shaders of a landscape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Step {
    Ground,
    Start,
    Nearness,
    /// With 64-bit atomics, or without.
    Choose(bool),
    Between,
    Splat(bool),
    Resolve,
    Sort,
    Impostors,
    Large,
    Triangles,
}

impl Shader {
    /// The whole text.
    pub(crate) fn text(self) -> String {
        const SPLAT: &str = include_str!("wgsl/splat.wgsl");
        let parts: &[&str] = match self {
            Self::Splat64 => &[
                COMMON, LIT_BLOCK, CELL, WIND, BEND, POINTS, CHUNK_OF, LARGE_LIST, SPLAT_BOX,
                SPLAT, KEEP64,
            ],
            Self::Splat32 => &[
                COMMON, LIT_BLOCK, CELL, WIND, BEND, POINTS, CHUNK_OF, LARGE_LIST, SPLAT_BOX,
                SPLAT, KEEP32,
            ],
            Self::Points => {
                let small = include_str!("wgsl/points_small.wgsl");
                &[COMMON, LIT_BLOCK, CELL, WIND, BEND, POINTS, LARGE, small]
            }
            Self::Triangles => {
                let block = include_str!("wgsl/triangles_block.wgsl");
                &[COMMON, LIT_BLOCK, CELL, WIND, BEND, SURFACE, TRIANGLES, block]
            }
            Self::Foliage => &[COMMON, SURFACE, WIND, include_str!("wgsl/foliage.wgsl")],
            Self::Views => &[COMMON, LIT_BLOCK, TILE, include_str!("wgsl/views.wgsl")],
            Self::Volume => &[COMMON, LIT_BLOCK, include_str!("wgsl/volume.wgsl")],
            Self::Present => &[include_str!("wgsl/present.wgsl")],
            Self::Landscape(step) => return [constants(), step.text()].concat(),
        };
        [constants(), parts.concat()].concat()
    }

    pub(crate) fn module(self, device: &Device) -> ShaderModule {
        device.create_shader_module(ShaderModuleDescriptor {
            label: Some(&format!("{self:?}")),
            source: ShaderSource::Wgsl(self.text().into()),
        })
    }
}

impl Step {
    fn text(self) -> String {
        const LIGHT: &str = include_str!("wgsl/landscape/light.wgsl");
        const NEARNESS: &str = include_str!("wgsl/landscape/nearness.wgsl");
        const TREE: &str = include_str!("wgsl/landscape/tree.wgsl");
        const UNBENT: &str = include_str!("wgsl/landscape/unbent.wgsl");
        const BOARDS: &str = include_str!("wgsl/landscape/boards.wgsl");
        const TREES: &str = include_str!("wgsl/landscape/trees.wgsl");
        let keep = |wide| if wide { KEEP64 } else { KEEP32 };
        let parts: &[&str] = match self {
            Self::Ground => &[LIGHT, include_str!("wgsl/landscape/ground.wgsl")],
            Self::Start => &[include_str!("wgsl/landscape/start.wgsl")],
            Self::Nearness => &[include_str!("wgsl/landscape/near.wgsl")],
            Self::Choose(wide) => {
                let choose = include_str!("wgsl/landscape/choose.wgsl");
                let shared =
                    [LIGHT, CELL, UNBENT, POINTS, CHUNK_OF, SPLAT_BOX, NEARNESS, TREE, TREES];
                return [COMMON, &shared.concat(), BOARDS, choose, keep(wide)].concat();
            }
            Self::Sort => return [BOARDS, include_str!("wgsl/landscape/sort.wgsl")].concat(),
            Self::Between => return include_str!("wgsl/landscape/steps.wgsl").into(),
            Self::Splat(wide) => {
                let splat = include_str!("wgsl/landscape/splat.wgsl");
                let shared =
                    [LIGHT, CELL, UNBENT, POINTS, CHUNK_OF, LARGE_LIST, SPLAT_BOX, NEARNESS];
                return [COMMON, &shared.concat(), splat, keep(wide)].concat();
            }
            Self::Resolve => &[LIGHT, include_str!("wgsl/landscape/resolve.wgsl")],
            Self::Impostors => {
                &[LIGHT, CELL, TREE, TILE, include_str!("wgsl/landscape/impostor.wgsl")]
            }
            Self::Large => &[LIGHT, CELL, UNBENT, POINTS, LARGE],
            Self::Triangles => &[
                LIGHT,
                CELL,
                UNBENT,
                SURFACE,
                TRIANGLES,
                include_str!("wgsl/landscape/triangles.wgsl"),
            ],
        };
        [COMMON, &parts.concat()].concat()
    }
}

/// Numbers that the Rust code has too.
fn constants() -> String {
    let words = [
        ("FADE", FADE),
        ("PICK", views::PICK),
        ("COVER", views::COVER),
        ("CHUNK", CHUNK),
        ("ATLAS_WIDTH", forest_volume::ATLAS_WIDTH),
        ("TILE", forest_scene::TILE as u32),
        ("STEPS", forest_scene::STEPS),
        ("MOST_SIZE", SizeCode::MAX.bits().into()),
        ("PATCH", forest_scene::PATCH),
        ("BLOCK", landscape::BLOCK),
        ("VIEW_STEPS", landscape::VIEW_STEPS),
        ("PROBE", landscape::PROBE),
        ("MOST_NEARNESS", landscape::MOST_NEARNESS as u32),
        ("MOST_BANDS", landscape::MOST_BANDS as u32),
        ("RUN_TRIANGLES", landscape::RUN_TRIANGLES),
        ("BUCKETS", landscape::BUCKETS),
        ("MOST_DRAWS", 4 * forest_scene::MOST_SPECIES as u32),
        ("COMPASS_AROUND", landscape::COMPASS[0]),
        ("COMPASS_UP", landscape::COMPASS[1]),
        ("DICTIONARY", forest_foliage::DICTIONARY.into()),
        ("RAW_SIDE", crate::volume::RAW_SIDE),
        ("MOST_LEVELS", crate::volume::MOST_LEVELS as u32),
    ];
    let floats = [
        ("HALF_TURN", std::f64::consts::PI),
        ("STEADY", STEADY.into()),
        ("ALONG_STEPS", ALONG_STEPS.into()),
        ("MOST_LEAN", forest_foliage::sway::MOST_LEAN.into()),
        ("GUST", landscape::GUST),
        ("OWN_PHASE", landscape::OWN_PHASE),
        ("TRANSLUCENCY_STEPS", crate::materials::TRANSLUCENCY_STEPS),
        ("BUCKETS_PER_OCTAVE", f64::from(landscape::BUCKETS_PER_OCTAVE)),
        ("IMPOSTOR_FADE", forest_scene::IMPOSTOR_FADE),
        ("LEAST_IMPOSTOR", forest_scene::LEAST_IMPOSTOR),
        ("HEIGHT_STEPS", forest_scene::HEIGHT_STEPS),
        ("DIFFUSE", forest_scene::DIFFUSE),
        ("DEPTH_STEPS", f64::from(forest_scene::DEPTH_STEPS)),
        ("GAIN_POINTS", Gain::POINTS.factor().into()),
        ("GAIN_VIEWS", Gain::VIEWS.factor().into()),
        ("GAIN_VOLUME", Gain::VOLUME.factor().into()),
        ("ALL_WAYS", forest_foliage::ALL_WAYS.into()),
        ("LEAST_SHARE", landscape::LEAST_SHARE),
        ("SIZE_TOP", SizeCode::LOG2_TOP),
        ("SIZES_PER_OCTAVE", SizeCode::PER_OCTAVE),
        ("FLATNESS_STEPS", f64::from(spheroid::STEPS)),
        ("THINNEST", spheroid::THINNEST),
        ("OFF_STEPS", views::OFF_STEPS),
        ("SLACK", views::SLACK),
        ("JOINED", views::JOINED),
        ("MOST_STEPS", views::MOST_STEPS),
        ("BEHIND", views::BEHIND),
        ("LEAST_THROUGH", f64::from(forest_volume::LEAST_THROUGH)),
    ];
    let swings = SWINGS.map(|[far, fast, shift]| format!("vec3f({far:?}, {fast:?}, {shift:?})"));
    let mut text = format!("const SWINGS = array<vec3f, 4>({});\n", swings.join(", "));
    for (name, value) in words {
        text += &format!("const {name}: u32 = {value}u;\n");
    }
    for (name, value) in floats {
        text += &format!("const {name}: f32 = {value:?};\n");
    }
    text
}
