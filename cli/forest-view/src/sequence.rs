//! Sequences of pictures: a folder of frames, and an animated preview of them.

use crate::args::Args;
use crate::failure::Usage;
use crate::output;
use anyhow::{Context, Result};
use forest_foliage::Wind;
use image::imageops::{FilterType, resize};
use image::{RgbImage, RgbaImage};
use std::path::{Path, PathBuf};

/// Pixels of the longer side of a preview.
const PREVIEW: u32 = 480;

/// Wind of sequences, if nothing else is asked for.
const BREEZE: f32 = 0.6;

/// Frames that are drawn one after the other.
pub(crate) struct Sequence {
    folder: PathBuf,
    rate: u16,
    previews: Vec<RgbImage>,
}

impl Sequence {
    /// The sequence that `args` ask for, and the wind of each of its frames; its folder is made, or
    /// empty.
    pub(crate) fn new(args: &Args, seconds: f64, folder: &Path) -> Result<(Self, Vec<Wind>)> {
        let name = folder.display();
        std::fs::create_dir_all(folder).with_context(|| name.to_string())?;
        if std::fs::read_dir(folder).with_context(|| name.to_string())?.next().is_some() {
            let rule = "a sequence is written into a new or empty folder";
            return Err(Usage(format!("{name}: {rule}")).into());
        }
        let start = args.wind.unwrap_or(Wind { strength: BREEZE, ..Wind::default() });
        let count = (seconds * f64::from(args.rate)).ceil().max(1.0) as u32;
        let wind = |i: u32| Wind { time: start.time + i as f32 / f32::from(args.rate), ..start };
        let sequence = Self { folder: folder.into(), rate: args.rate, previews: Vec::new() };
        Ok((sequence, (0..count).map(wind).collect()))
    }

    /// Writes a frame.
    pub(crate) fn add(&mut self, size: [u32; 2], pixels: &[[u8; 4]], alpha: bool) -> Result<()> {
        let path = self.folder.join(format!("{:04}.png", self.previews.len()));
        output::write_png(&path, size, pixels, alpha)?;
        let whole = RgbaImage::from_raw(size[0], size[1], pixels.as_flattened().to_vec());
        let whole = image::DynamicImage::from(whole.context("a picture of another size")?);
        let shrink = (f64::from(PREVIEW) / f64::from(size[0].max(size[1]))).min(1.0);
        let [w, h] = size.map(|s| ((f64::from(s) * shrink).round() as u32).max(1));
        self.previews.push(resize(&whole.into_rgb8(), w, h, FilterType::Triangle));
        Ok(())
    }

    /// Writes the preview, an animated PNG; what was written, in words.
    pub(crate) fn finish(self) -> Result<String> {
        let first = self.previews.first().context("a sequence without frames")?;
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, first.width(), first.height());
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_animated(self.previews.len() as u32, 0)?;
        encoder.set_frame_delay(1, self.rate)?;
        let mut writer = encoder.write_header()?;
        for preview in &self.previews {
            writer.write_image_data(preview.as_raw())?;
        }
        writer.finish()?;
        let path = self.folder.join("preview.png");
        output::write_file(&path, &bytes)?;
        Ok(format!("{} frames and {}", self.previews.len(), path.display()))
    }
}
