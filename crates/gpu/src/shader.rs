//! The shaders: WGSL files put together, with the constants of the crates whose rules they follow.

use crate::CHUNK;
use forest_points::spheroid;
use forest_views as views;
use wgpu::{Device, ShaderModule, ShaderModuleDescriptor, ShaderSource};

const COMMON: &str = include_str!("wgsl/common.wgsl");
const CELL: &str = include_str!("wgsl/cell.wgsl");
const POINTS: &str = include_str!("wgsl/points.wgsl");
const LIT_BLOCK: &str = include_str!("wgsl/lit_block.wgsl");
const CHUNKS: &str = include_str!("wgsl/chunk.wgsl");
const SPLAT_BOX: &str = include_str!("wgsl/splat_box.wgsl");
const KEEP64: &str = include_str!("wgsl/keep64.wgsl");
const KEEP32: &str = include_str!("wgsl/keep32.wgsl");
const LARGE: &str = include_str!("wgsl/points_large.wgsl");
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
    Views,
    Volume,
    Present,
}

impl Shader {
    /// The whole text.
    pub(crate) fn text(self) -> String {
        const SPLAT: &str = include_str!("wgsl/splat.wgsl");
        let parts: &[&str] = match self {
            Self::Splat64 => &[COMMON, LIT_BLOCK, CELL, POINTS, CHUNKS, SPLAT_BOX, SPLAT, KEEP64],
            Self::Splat32 => &[COMMON, LIT_BLOCK, CELL, POINTS, CHUNKS, SPLAT_BOX, SPLAT, KEEP32],
            Self::Points => {
                let small = include_str!("wgsl/points_small.wgsl");
                &[COMMON, LIT_BLOCK, CELL, POINTS, LARGE, small]
            }
            Self::Triangles => {
                let block = include_str!("wgsl/triangles_block.wgsl");
                &[COMMON, LIT_BLOCK, CELL, TRIANGLES, block]
            }
            Self::Views => &[COMMON, LIT_BLOCK, include_str!("wgsl/views.wgsl")],
            Self::Volume => &[COMMON, include_str!("wgsl/volume.wgsl")],
            Self::Present => &[include_str!("wgsl/present.wgsl")],
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

/// Numbers that the Rust code has too.
fn constants() -> String {
    let words = [
        ("FADE", FADE),
        ("PICK", views::PICK),
        ("COVER", views::COVER),
        ("CHUNK", CHUNK),
        ("ATLAS_WIDTH", forest_volume::ATLAS_WIDTH),
        ("RAW_SIDE", crate::volume::RAW_SIDE),
        ("MOST_LEVELS", crate::volume::MOST_LEVELS as u32),
    ];
    let floats = [
        ("FLATNESS_STEPS", f64::from(spheroid::STEPS)),
        ("THINNEST", spheroid::THINNEST),
        ("OFF_STEPS", views::OFF_STEPS),
        ("SLACK", views::SLACK),
        ("JOINED", views::JOINED),
        ("MOST_STEPS", views::MOST_STEPS),
        ("BEHIND", views::BEHIND),
        ("LEAST_THROUGH", f64::from(forest_volume::LEAST_THROUGH)),
    ];
    let mut text = String::new();
    for (name, value) in words {
        text += &format!("const {name}: u32 = {value}u;\n");
    }
    for (name, value) in floats {
        text += &format!("const {name}: f32 = {value:?};\n");
    }
    text
}
