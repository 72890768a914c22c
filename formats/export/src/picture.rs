//! Files to write, and pictures as PNG.

use crate::ExportError;
use image::{DynamicImage, ImageFormat};
use std::io::Cursor;

/// A file of an export.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExportFile {
    /// Its name, without a folder.
    pub name: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

/// No picture has more texels: 16384².
const MAX_TEXELS: u64 = 1 << 28;

/// Refuses pictures that no memory holds.
pub(crate) fn check_size(width: u32, height: u32) -> Result<(), ExportError> {
    check_texels(u64::from(width) * u64::from(height))
}

/// Refuses pictures of more than [`MAX_TEXELS`].
pub(crate) fn check_texels(texels: u64) -> Result<(), ExportError> {
    if texels > MAX_TEXELS {
        let problem = format!("the views have {texels} texels; an export has {MAX_TEXELS} at most");
        return Err(ExportError::Unsuited(problem));
    }
    Ok(())
}

/// A picture as PNG.
pub(crate) fn png(image: impl Into<DynamicImage>) -> Result<Vec<u8>, ExportError> {
    let mut out = Cursor::new(Vec::new());
    let image: DynamicImage = image.into();
    image.write_to(&mut out, ImageFormat::Png)?;
    Ok(out.into_inner())
}
