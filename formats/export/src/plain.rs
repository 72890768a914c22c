//! Atlases for any reader: PNG, EXR and KTX2, with a side file.

use crate::ExportError;
use crate::engine::keyed;
use crate::grid::WholeTiles;
use crate::ktx2::{Format, TextureArray};
use crate::picture::{ExportFile, check_size, check_texels, png};
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, SmallVec, WritableImage,
};
use forest_soup::srgb8_to_linear;
use forest_views::{Channel, Layout, Quality, ViewsBlock, decode_height, decode_normal, encode};
use image::{ImageBuffer, Luma, Rgb, RgbImage, RgbaImage};
use serde_json::json;
use std::io::Cursor;

/// How an atlas is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlainFormat {
    /// Colour, object-space normals, 16-bit depth and occlusion as 8-bit PNG files of all tiles.
    Png,
    /// One linear file: premultiplied R, G, B, A; object-space normals N.X, N.Y, N.Z; Z, the
    /// distance behind the plane through the middle in world units; sky, the occlusion.
    Exr,
    /// A texture array for each channel, a layer a view, with all mips: BC7 colour whose alpha test
    /// at ½ keeps the coverage at every mip, BC5 normals in the view's frame, BC4 depth and
    /// occlusion.
    Ktx2,
}

/// Alpha from which a texel of a texture array is shown.
const CUTOFF: f32 = 0.5;

/// Writes the views of a pack in `formats`; `name` is that of the tree. A side file tells directions,
/// sizes and, for each file, the alpha from which a texel is shown (null: alpha is the coverage).
///
/// # Errors
/// When the pack is damaged or a file cannot be encoded.
pub fn plain(
    block: &ViewsBlock,
    formats: &[PlainFormat],
    name: &str,
) -> Result<Vec<ExportFile>, ExportError> {
    let (mut files, mut list) = (Vec::new(), Vec::new());
    for format in formats {
        let new = match format {
            PlainFormat::Png => png_files(block, name)?,
            PlainFormat::Exr => vec![exr_file(block, name)?],
            PlainFormat::Ktx2 => ktx2_files(block, name)?,
        };
        let keyed = *format == PlainFormat::Ktx2;
        let cutoff = |f: &ExportFile| keyed && f.name.ends_with("_color.ktx2");
        list.extend(new.iter().map(|f| {
            json!({
                "name": f.name,
                "alphaCutoff": if cutoff(f) { json!(CUTOFF) } else { json!(null) },
            })
        }));
        files.extend(new);
    }
    let h = &block.header;
    let columns = columns(block);
    let count = h.directions.count();
    let tile = |i: u32| {
        let frame = &block.frames[i as usize];
        json!({
            "column": i % columns,
            "row": i / columns,
            "layer": i,
            "toCamera": frame.back.to_array(),
            "up": frame.up.to_array(),
        })
    };
    let side = json!({
        "schema": "forest-bake/views/1",
        "columns": columns,
        "rows": count.div_ceil(columns),
        "tileTexels": h.levels[0].texels,
        "tileWidth": 2.0 * h.half,
        "depthRadius": h.radius,
        "center": h.center,
        "files": list,
        "tiles": (0..count).map(tile).collect::<Vec<_>>(),
    });
    let text = serde_json::to_string_pretty(&side).expect("plain JSON") + "\n";
    files.push(ExportFile { name: format!("{name}.views.json"), bytes: text.into_bytes() });
    Ok(files)
}

/// Tiles in a row of the sheet: views in order, the first at the top left.
fn columns(block: &ViewsBlock) -> u32 {
    match block.directions().layout {
        Layout::Octahedral { side } => side,
        Layout::Rings { points, .. } => points,
    }
}

fn png_files(block: &ViewsBlock, name: &str) -> Result<Vec<ExportFile>, ExportError> {
    let whole = WholeTiles::read(block, 0)?;
    let (columns, side) = (columns(block), whole.side);
    let count = block.directions().count();
    check_size(columns * side, count.div_ceil(columns) * side)?;
    let size = [columns * side, count.div_ceil(columns) * side];
    let mut color = RgbaImage::new(size[0], size[1]);
    let mut normal = RgbImage::new(size[0], size[1]);
    let mut depth = ImageBuffer::<Luma<u16>, Vec<u16>>::new(size[0], size[1]);
    let mut sky = ImageBuffer::<Luma<u8>, Vec<u8>>::new(size[0], size[1]);
    for view in 0..count {
        let frame = &block.frames[view as usize];
        for (x, y, t) in whole.texels(view) {
            let (px, py) = (view % columns * side + x, view / columns * side + y);
            color.put_pixel(px, py, image::Rgba(t.color));
            let n = decode_normal(t.normal, frame).to_array();
            normal.put_pixel(px, py, Rgb(n.map(|v| ((v * 0.5 + 0.5) * 255.0).round() as u8)));
            depth.put_pixel(px, py, Luma([t.depth]));
            sky.put_pixel(px, py, Luma([t.sky]));
        }
    }
    let channels = block.header.channels;
    let mut files = Vec::new();
    let mut add = |what: &str, bytes: Vec<u8>| {
        files.push(ExportFile { name: format!("{name}_{what}.png"), bytes });
    };
    add("color", png(color)?);
    if channels.normal {
        add("normal", png(normal)?);
    }
    if channels.depth {
        add("depth", png(depth)?);
    }
    if channels.sky {
        add("ao", png(sky)?);
    }
    Ok(files)
}

fn exr_file(block: &ViewsBlock, name: &str) -> Result<ExportFile, ExportError> {
    let whole = WholeTiles::read(block, 0)?;
    let (columns, side) = (columns(block), whole.side);
    let count = block.directions().count();
    check_size(columns * side, count.div_ceil(columns) * side)?;
    let size = [columns * side, count.div_ceil(columns) * side].map(|v| v as usize);
    let (h, texels) = (&block.header, size[0] * size[1]);
    let mut names = vec!["R", "G", "B", "A"];
    if h.channels.normal {
        names.extend(["N.X", "N.Y", "N.Z"]);
    }
    if h.channels.depth {
        names.push("Z");
    }
    if h.channels.sky {
        names.push("sky");
    }
    let mut planes = vec![vec![0.0f32; texels]; names.len()];
    for view in 0..count {
        let frame = &block.frames[view as usize];
        for (x, y, t) in whole.texels(view) {
            let px = (view % columns * side + x) as usize;
            let i = (view / columns * side + y) as usize * size[0] + px;
            let [r, g, b, a] = t.color;
            let alpha = f32::from(a) / 255.0;
            let mut values = [r, g, b].map(|c| srgb8_to_linear(c) * alpha).to_vec();
            values.push(alpha);
            if h.channels.normal {
                let n = decode_normal(t.normal, frame);
                values.extend(n.to_array().map(|v| v as f32));
            }
            if h.channels.depth {
                let depth = -h.radius * decode_height(t.depth);
                values.push(if a > 0 { depth as f32 } else { f32::INFINITY });
            }
            if h.channels.sky {
                values.push(f32::from(t.sky) / 255.0);
            }
            planes.iter_mut().zip(values).for_each(|(plane, v)| plane[i] = v);
        }
    }
    let channels: SmallVec<[AnyChannel<FlatSamples>; 4]> = names
        .into_iter()
        .zip(planes)
        .map(|(n, plane)| AnyChannel::new(n, FlatSamples::F32(plane)))
        .collect();
    let image = Image::from_encoded_channels(
        (size[0], size[1]),
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels),
    );
    let mut out = Cursor::new(Vec::new());
    image.write().to_buffered(&mut out)?;
    Ok(ExportFile { name: format!("{name}.exr"), bytes: out.into_inner() })
}

/// Alpha away from ½ on its own side, so that what a block encoder changes does not carry it across.
fn apart(alpha: u8) -> u8 {
    let a = f32::from(alpha);
    let kept = 1.0 - 2.0 * MARGIN;
    (if alpha < 128 { a * kept } else { 255.0 - (255.0 - a) * kept }).round() as u8
}

/// Share of the range of alpha on either side of ½ that [`apart`] leaves free.
const MARGIN: f32 = 0.125;

fn ktx2_files(block: &ViewsBlock, name: &str) -> Result<Vec<ExportFile>, ExportError> {
    let h = &block.header;
    let texels = u64::from(h.levels[0].texels).pow(2) * u64::from(h.directions.count());
    check_texels(texels)?;
    let channels: Vec<Channel> = Channel::ALL.into_iter().filter(|c| h.channels.has(*c)).collect();
    let mut levels: Vec<Vec<Vec<u8>>> = vec![Vec::new(); channels.len()];
    for level in 0..h.levels.len() {
        let whole = WholeTiles::read(block, level)?;
        // Blocks are whole: the outermost texels are repeated.
        let side = whole.side.next_multiple_of(4);
        for (&channel, levels) in channels.iter().zip(&mut levels) {
            let mut raw = Vec::new();
            for view in 0..h.directions.count() {
                let cutoff = f32::from(whole.cutoff(view)) / 255.0;
                for i in 0..side * side {
                    let inside = |v: u32| v.min(whole.side - 1);
                    let t = whole.texel(view, inside(i % side), inside(i / side));
                    match channel {
                        Channel::Color => {
                            let [r, g, b, a] = t.color;
                            raw.extend([r, g, b, apart(keyed(a, cutoff, CUTOFF))]);
                        }
                        Channel::Normal => raw.extend(t.normal),
                        Channel::Depth => raw.extend(t.depth.to_le_bytes()),
                        Channel::Sky => raw.push(t.sky),
                    }
                }
            }
            levels.push(encode(channel, Quality::Block, side, &raw));
        }
    }
    let file = |(channel, levels): (&Channel, Vec<Vec<u8>>)| {
        let (what, format) = match channel {
            Channel::Color => ("color", Format::Bc7Srgb),
            Channel::Normal => ("normal", Format::Bc5),
            Channel::Depth => ("depth", Format::Bc4),
            Channel::Sky => ("ao", Format::Bc4),
        };
        let side = h.levels[0].texels;
        let array = TextureArray { format, side, layers: h.directions.count(), levels };
        ExportFile { name: format!("{name}_{what}.ktx2"), bytes: array.to_bytes() }
    };
    Ok(channels.iter().zip(levels).map(file).collect())
}
