//! Pictures and words.

use anyhow::{Context, Result};
use forest_gpu::{Drawn, What};
use forest_volume::Detail;
use image::{DynamicImage, ImageFormat, RgbaImage};
use std::io::Cursor;
use std::path::Path;

/// Writes 8-bit sRGB pixels as a PNG, whole or not at all.
pub(crate) fn write_png(
    path: &Path,
    [width, height]: [u32; 2],
    pixels: &[[u8; 4]],
    alpha: bool,
) -> Result<()> {
    let picture = RgbaImage::from_raw(width, height, pixels.as_flattened().to_vec())
        .context("a picture of another size")?;
    let picture: DynamicImage = picture.into();
    let picture = if alpha { picture } else { picture.into_rgb8().into() };
    let mut png = Cursor::new(Vec::new());
    picture.write_to(&mut png, ImageFormat::Png)?;
    write_file(path, png.get_ref())
}

/// Writes a file whole or not at all.
pub(crate) fn write_file(path: &Path, bytes: &[u8]) -> Result<()> {
    forest_pack::write_whole(path, bytes).with_context(|| path.display().to_string())
}

/// A level in words.
pub(crate) fn level(what: &What) -> String {
    match what {
        What::Points(t) if t.largest.0 <= 0.0 => "triangles".into(),
        What::Points(t) => format!("points, s_m {:.3} px², s_M {:.3} px²", t.finest.0, t.largest.0),
        What::Views(level, lookup) => format!("views, level {level}, {}", lookup.name()),
        What::Foliage(level) => format!("foliage, level {level}"),
        What::Volume(Detail::Level(level), _) => format!("volume, level {level}"),
        What::Volume(Detail::Planes { texel, .. }, _) => format!("volume, texels of {texel} px"),
    }
}

/// A level and what it took, in words.
pub(crate) fn describe(what: &What, drawn: &Drawn) -> String {
    let counts = [
        (drawn.points, "points"),
        (drawn.triangles, "triangles"),
        (drawn.views, "views"),
        (drawn.cells, "cells"),
    ];
    let counts: Vec<String> =
        counts.iter().filter(|c| c.0 > 0).map(|(n, what)| format!("{n} {what}")).collect();
    format!("{}: {}, {} bytes", level(what), counts.join(", "), drawn.bytes)
}
