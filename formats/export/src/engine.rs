//! Atlases in the layout that impostor shaders of engines read.
//!
//! All three read a hemi-octahedral grid of upright tiles and blend three of them. They differ in
//! the order of rows, in the frame of the tile at the zenith, in how colours, normals and depth are
//! packed, and in where the alpha test cuts.

use crate::ExportError;
use crate::grid::{Texel, WholeTiles};
use crate::picture::{ExportFile, check_size, png};
use forest_soup::{linear_to_srgb8, srgb8_to_linear};
use forest_views::{Dome, Layout, ViewFrame, ViewsBlock, decode_height, normal_parts};
use glam::DVec3;
use image::{Rgba, RgbaImage};
use serde_json::{Value, json};

/// Whose shader will read the atlas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Engine {
    /// Unreal Engine's impostor materials (ImpostorBaker): z up, left-handed, centimetres.
    Unreal,
    /// Godot's octahedral impostors addon.
    Godot,
    /// three.js, octahedral-impostor.
    Three,
}

/// From this many views a side on, shaders turn more tiles than the zenith's: their frames switch
/// at 2.6° from it.
const MOST_SIDE: u32 = 25;

/// A tile's image axes: unit vectors in the pack's space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TileFrame {
    /// To the right of the image.
    pub right: DVec3,
    /// To the top of the image.
    pub up: DVec3,
    /// Towards the camera.
    pub back: DVec3,
}

impl Engine {
    /// Its name on the command line and in side files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Unreal => "unreal",
            Self::Godot => "godot",
            Self::Three => "three",
        }
    }

    /// Alpha from which its shader shows a texel.
    pub fn alpha_cutoff(self) -> f32 {
        match self {
            Self::Unreal | Self::Godot => 0.5,
            Self::Three => 0.4,
        }
    }

    /// The row of the image, from the top, of a row of the grid.
    fn image_row(self, row: u32, side: u32) -> u32 {
        match self {
            Self::Godot => row,
            // Unreal counts the other diagonal from the top; three.js flips images when it loads
            // them.
            Self::Unreal | Self::Three => side - 1 - row,
        }
    }

    /// Quarter turns, counter-clockwise as one looks at the image, from the pack's tile to the
    /// engine's: at the zenith its image has another side on top.
    fn quarter_turns(self, back: DVec3) -> u32 {
        match self {
            _ if back.y < 0.999_999 => 0,
            Self::Godot => 2,
            Self::Unreal | Self::Three => 3,
        }
    }

    /// The axes of a tile's image.
    pub fn tile_frame(self, back: DVec3) -> TileFrame {
        let ViewFrame { mut right, mut up, back } = ViewFrame::new(back);
        for _ in 0..self.quarter_turns(back) {
            // The image turns, so that its axes turn the other way in the object.
            (right, up) = (-up, right);
        }
        TileFrame { right, up, back }
    }
}

/// The view of the pack in each tile of the engine's image, row by row from the top.
///
/// # Errors
/// When the pack's views are not laid out in a way that the engine reads.
pub fn tiles(block: &ViewsBlock, engine: Engine) -> Result<Vec<u32>, ExportError> {
    let unsuited = |problem: String| Err(ExportError::Unsuited(problem));
    let name = engine.name();
    let directions = block.directions();
    let Layout::Octahedral { side } = directions.layout else {
        return unsuited(format!("{name} reads octahedral views; bake with --layout octahedral"));
    };
    if directions.dome == Dome::Full && engine != Engine::Godot {
        return unsuited(format!("the {name} preset is for views from above the horizon"));
    }
    if side > MOST_SIDE {
        return unsuited(format!("{side} views a side; {name} takes {MOST_SIDE} at most"));
    }
    let cell = |i: u32| engine.image_row(i / side, side) * side + i % side;
    Ok((0..side * side).map(cell).collect())
}

/// Writes the textures and the side file of `engine`; `name` is that of the tree.
///
/// # Errors
/// When the pack is damaged, or its views are not laid out in a way that the engine reads.
pub fn for_engine(
    block: &ViewsBlock,
    engine: Engine,
    name: &str,
) -> Result<Vec<ExportFile>, ExportError> {
    let order = tiles(block, engine)?;
    let total = block.header.levels[0].texels * (order.len() as u32).isqrt();
    check_size(total, total)?;
    let whole = WholeTiles::read(block, 0)?;
    let side = (order.len() as u32).isqrt();
    let channels = block.header.channels;
    let atlas = Atlas { block, engine, whole: &whole, order: &order, side };
    let mut files = Vec::new();
    let mut add = |file: &str, pixel: fn(&Shown) -> [u8; 4]| -> Result<(), ExportError> {
        files.push(ExportFile { name: file.into(), bytes: png(atlas.image(pixel))? });
        Ok(())
    };
    match engine {
        Engine::Three => {
            add("albedo.png", Shown::premultiplied)?;
            add("normalDepth.png", Shown::tile_normal_and_height)?;
        }
        Engine::Godot => {
            add("result_albedo.png", Shown::straight)?;
            add("result_normal.png", Shown::godot_normal)?;
            if channels.depth {
                add("result_depth.png", Shown::godot_depth)?;
            }
            add("result_orm.png", Shown::occlusion_rough_metal)?;
        }
        Engine::Unreal => {
            add(&format!("T_{name}_Impostor_BaseColor.png"), Shown::straight)?;
            add(&format!("T_{name}_Impostor_Normal.png"), Shown::unreal_normal_and_height)?;
        }
    }
    let textures: Vec<String> = files.iter().map(|f| f.name.clone()).collect();
    let side_file = side_file(block, engine, side, whole.side, &textures);
    let text = serde_json::to_string_pretty(&side_file).expect("plain JSON") + "\n";
    files.push(ExportFile { name: format!("{name}.impostor.json"), bytes: text.into_bytes() });
    Ok(files)
}

/// What people and loaders want to know, in the engine's words and units.
fn side_file(
    block: &ViewsBlock,
    engine: Engine,
    side: u32,
    texels: u32,
    textures: &[String],
) -> Value {
    let h = &block.header;
    let [x, y, z] = h.center;
    let full = h.directions.dome == Dome::Full;
    let (width, cm) = (2.0 * h.half, 100.0);
    let uniforms = match engine {
        Engine::Three => json!({
            "spritesPerSide": side,
            "alphaClamp": engine.alpha_cutoff(),
            "impostorTransform": { "scale": width, "position": [x, y, z] },
        }),
        Engine::Godot => json!({
            "imposterFrames": [side, side],
            "isFullSphere": full,
            "scale": h.half,
            "aabb_max": h.half / 2.0,
            "positionOffset": [x, y, z],
            "alpha_clamp": engine.alpha_cutoff(),
        }),
        Engine::Unreal => json!({
            "FramesNum": side,
            "MeshSize": width * cm,
            "PivotOffset": [x * cm, z * cm, y * cm],
        }),
    };
    json!({
        "schema": "forest-bake/impostor/1",
        "for": engine.name(),
        "layout": if full { "octahedral" } else { "hemi-octahedral" },
        "tilesPerSide": side,
        "tileTexels": texels,
        "tileWidth": width,
        "center": [x, y, z],
        "radius": h.half,
        "premultiplied": engine == Engine::Three,
        "albedoColorSpace": "srgb",
        "alphaCutoff": engine.alpha_cutoff(),
        "textures": textures,
        "uniforms": uniforms,
    })
}

/// An atlas in the making.
struct Atlas<'a> {
    block: &'a ViewsBlock<'a>,
    engine: Engine,
    whole: &'a WholeTiles<'a>,
    order: &'a [u32],
    side: u32,
}

/// A texel and what the packing of channels needs to know of it.
struct Shown {
    texel: Texel,
    /// Alpha for the engine's cutoff.
    alpha: u8,
    /// Normal along the image's right, up and towards the camera.
    normal: [f64; 3],
    frame: TileFrame,
    /// Height towards the camera above the middle, in tiles: −½ … ½.
    height: f64,
}

impl Atlas<'_> {
    fn image(&self, pixel: fn(&Shown) -> [u8; 4]) -> RgbaImage {
        let texels = self.whole.side;
        let mut image = RgbaImage::new(self.side * texels, self.side * texels);
        let depth_scale = self.block.header.radius / self.block.header.half;
        for (cell, &view) in (0..).zip(self.order) {
            let back = self.block.directions().direction(view);
            let frame = self.engine.tile_frame(back);
            let turns = self.engine.quarter_turns(back);
            let cutoff = f32::from(self.whole.cutoff(view)) / 255.0;
            for y in 0..texels {
                for x in 0..texels {
                    let (tx, ty) = source(turns, x, y, texels);
                    let texel = self.whole.texel(view, tx, ty);
                    let [mut nx, mut ny, nz] = normal_parts(texel.normal);
                    for _ in 0..turns {
                        (nx, ny) = (-ny, nx);
                    }
                    let shown = Shown {
                        texel,
                        alpha: keyed(texel.color[3], cutoff, self.engine.alpha_cutoff()),
                        normal: [nx, ny, nz],
                        frame,
                        height: 0.5 * depth_scale * decode_height(texel.depth),
                    };
                    let (ox, oy) = (cell % self.side * texels, cell / self.side * texels);
                    image.put_pixel(ox + x, oy + y, Rgba(pixel(&shown)));
                }
            }
        }
        image
    }
}

/// The texel of the pack's tile that stands at (x, y) after counter-clockwise quarter turns.
fn source(turns: u32, x: u32, y: u32, side: u32) -> (u32, u32) {
    let last = side - 1;
    // A turn of the image brings to (x, y) what stood where a turn back leads.
    (0..turns).fold((x, y), |(x, y), _| (last - y, x))
}

/// Alpha moved so that what passed `from` passes `to`, and what did not does not.
pub(crate) fn keyed(alpha: u8, from: f32, to: f32) -> u8 {
    let a = f32::from(alpha) / 255.0;
    let moved = if a < from {
        a / from * to
    } else {
        to + (a - from) / (1.0 - from).max(1e-6) * (1.0 - to)
    };
    let code = (moved.clamp(0.0, 1.0) * 255.0).round();
    // Rounding must not carry a texel across the test (shaders compare with > as well as ≥).
    let limit = to * 255.0;
    if a >= from {
        code.max((limit + 0.01).ceil()) as u8
    } else {
        code.min((limit - 0.01).floor()) as u8
    }
}

fn signed(v: f64) -> u8 {
    ((v * 0.5 + 0.5).clamp(0.0, 1.0) * 255.0).round() as u8
}

impl Shown {
    /// Dilated sRGB and coverage.
    fn straight(&self) -> [u8; 4] {
        let [r, g, b, _] = self.texel.color;
        [r, g, b, self.alpha]
    }

    /// sRGB codes of linear colour times coverage.
    fn premultiplied(&self) -> [u8; 4] {
        let a = f32::from(self.alpha) / 255.0;
        let [r, g, b, _] = self.texel.color.map(|c| linear_to_srgb8(srgb8_to_linear(c) * a));
        [r, g, b, self.alpha]
    }

    /// Height above the tile's plane, 1 nearest; ½ in the background.
    fn height(&self) -> u8 {
        if self.alpha == 0 { 128 } else { signed(2.0 * self.height) }
    }

    fn tile_normal_and_height(&self) -> [u8; 4] {
        let [x, y, z] = self.normal.map(signed);
        [x, y, z, self.height()]
    }

    /// The addon keeps the tangent's sign reversed and rebuilds the third part.
    fn godot_normal(&self) -> [u8; 4] {
        let [x, y, z] = self.normal;
        [signed(-x), signed(y), signed(-z), 255]
    }

    /// 0 nearest; the background has the depth of what is beside it.
    fn godot_depth(&self) -> [u8; 4] {
        let depth = 255 - signed(2.0 * self.height);
        [depth, depth, depth, 255]
    }

    fn occlusion_rough_metal(&self) -> [u8; 4] {
        [self.texel.sky, 255, 0, 255]
    }

    fn unreal_normal_and_height(&self) -> [u8; 4] {
        let [x, y, z] = self.normal;
        let n = self.frame.right * x + self.frame.up * y + self.frame.back * z;
        // z up, left-handed.
        [signed(n.x), signed(n.z), signed(n.y), self.height()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn engines_turn_the_tile_at_the_zenith_as_their_shaders_do() {
        let of = |e: Engine| {
            let f = e.tile_frame(DVec3::Y);
            (f.right.round(), f.up.round())
        };
        assert_eq!(of(Engine::Three), (DVec3::NEG_Z, DVec3::NEG_X));
        assert_eq!(of(Engine::Unreal), (DVec3::NEG_Z, DVec3::NEG_X));
        assert_eq!(of(Engine::Godot), (DVec3::NEG_X, DVec3::Z));
        let f = Engine::Three.tile_frame(DVec3::X);
        assert_eq!((f.right.round(), f.up.round()), (DVec3::NEG_Z, DVec3::Y));
    }

    #[test]
    fn keyed_alpha_passes_the_new_test_where_it_passed_the_old() {
        for to in [0.4f32, 0.5] {
            for cutoff in [1u8, 60, 128, 200, 255] {
                for alpha in 0..=255u8 {
                    let got = f32::from(keyed(alpha, f32::from(cutoff) / 255.0, to)) / 255.0;
                    assert_eq!(alpha >= cutoff, got > to, "{alpha} {cutoff} {to} {got}");
                    assert_eq!(alpha >= cutoff, got >= to);
                }
            }
        }
        assert_eq!((keyed(0, 0.3, 0.5), keyed(255, 0.3, 0.5)), (0, 255));
    }

    #[test]
    fn a_quarter_turn_is_counter_clockwise() {
        // The texel on the right edge comes to the top.
        assert_eq!(source(1, 1, 0, 3), (2, 1));
        assert_eq!(source(2, 0, 0, 3), (2, 2));
        assert_eq!(source(3, 1, 0, 3), (0, 1));
        assert_eq!(source(0, 1, 2, 3), (1, 2));
    }
}
