//! Image files become textures.

use crate::ImportError;
use crate::source::Source;
use forest_soup::{Texture, Wrap};
use image::{DynamicImage, ImageReader};
use std::io::Cursor;

/// Decodes PNG, JPEG or WebP; 16-bit channels are rounded to 8, palettes and tRNS resolved.
pub(crate) fn decode(
    source: &Source,
    element: &str,
    bytes: &[u8],
) -> Result<DynamicImage, ImportError> {
    let invalid = |problem: String| source.invalid(element, problem);
    if bytes.starts_with(b"\xabKTX 20\xbb") {
        return Err(source.unsupported(format!("{element}: a KTX2 image (KHR_texture_basisu)")));
    }
    let mut reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|e| invalid(e.to_string()))?;
    if reader.format().is_none() {
        return Err(
            source.unsupported(format!("{element}: an image that is not PNG, JPEG or WebP"))
        );
    }
    let side = source.limits.texture_side;
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(side);
    limits.max_image_height = Some(side);
    limits.max_alloc = Some((u64::from(side) * u64::from(side) * 8).min(source.left()));
    reader.limits(limits);
    let image = reader.decode().map_err(|e| match e {
        image::ImageError::Unsupported(e) => {
            source.unsupported(format!("{element}: an image that is not PNG, JPEG or WebP ({e})"))
        }
        image::ImageError::Limits(e) => {
            let left = source.left();
            invalid(format!("{e} (at most {side} texels a side, and {left} bytes more)"))
        }
        e => invalid(e.to_string()),
    })?;
    if image.width() == 0 || image.height() == 0 {
        return Err(invalid(format!("{}×{} texels", image.width(), image.height())));
    }
    // As it was decoded, and as 8-bit RGBA.
    let texels = u64::from(image.width()) * u64::from(image.height());
    source.charge(element, image.as_bytes().len() as u64 + 4 * texels)?;
    Ok(image)
}

/// The image as a texture.
pub(crate) fn texture(name: String, image: &DynamicImage, wrap: [Wrap; 2]) -> Texture {
    let rgba = image.to_rgba8();
    let (width, height) = rgba.dimensions();
    let texels = rgba.pixels().map(|p| p.0).collect();
    Texture { name, width, height, texels, wrap }
}
