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

/// A picture as PNG.
pub(crate) fn png(image: &(impl Clone + Into<DynamicImage>)) -> Result<Vec<u8>, ExportError> {
    let mut out = Cursor::new(Vec::new());
    let image: DynamicImage = image.clone().into();
    image.write_to(&mut out, ImageFormat::Png)?;
    Ok(out.into_inner())
}
