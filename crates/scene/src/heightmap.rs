//! Heights and densities from pictures: PNG of 8 or 16 bits, and EXR.

use crate::error::SceneError;
use crate::land::{Land, MOST_POINTS};
use std::path::Path;

/// A picture of one channel: values in 0 … 1 (EXR: as they are), rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Grey {
    /// Width and height.
    pub size: [u32; 2],
    /// The values.
    pub values: Vec<f32>,
}

impl Grey {
    /// Reads a PNG (its luminance) or an EXR (its channel Y, R or the first one).
    ///
    /// # Errors
    /// When it cannot be read, or is larger than [`MOST_POINTS`] along a side.
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        let is_exr = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
        let grey = if is_exr { read_exr(path)? } else { read_png(path)? };
        if let Some(i) = grey.values.iter().position(|v| !v.is_finite()) {
            let [w, v] = [grey.size[0] as usize, i];
            let problem = format!("pixel {}, {} is {}", v % w, v / w, grey.values[i]);
            return Err(SceneError::invalid(path, "picture", problem));
        }
        Ok(grey)
    }

    /// The picture as a land `width` metres wide: each pixel a point, from `lowest` where it is 0 to
    /// `highest` where it is 1. The top of the picture is north (−z).
    pub fn land(&self, width: f64, [lowest, highest]: [f64; 2]) -> Land {
        let [nx, nz] = self.size;
        let depth = width * f64::from(nz.max(2) - 1) / f64::from(nx.max(2) - 1);
        let height = |v: &f32| (lowest + (highest - lowest) * f64::from(*v)) as f32;
        let heights = self.values.iter().map(height).collect();
        Land { points: self.size, size: [width, depth], heights }
    }

    /// The value at (u, v) in 0 … 1 across and down, between the four pixels around.
    pub fn sample(&self, u: f64, v: f64) -> f32 {
        let split = |t: f64, n: u32| {
            let at = (t * f64::from(n) - 0.5).clamp(0.0, f64::from(n - 1));
            let low = (at as u32).min(n.saturating_sub(2));
            (low, (at - f64::from(low)) as f32)
        };
        let [w, h] = self.size;
        let ((x, fx), (y, fy)) = (split(u, w), split(v, h));
        let at = |x: u32, y: u32| self.values[(y.min(h - 1) * w + x.min(w - 1)) as usize];
        let row = |y| at(x, y) + fx * (at(x + 1, y) - at(x, y));
        row(y) + fy * (row(y + 1) - row(y))
    }
}

fn check_size(path: &Path, size: [u32; 2]) -> Result<(), SceneError> {
    match size.iter().find(|n| !(1..=MOST_POINTS).contains(*n)) {
        None => Ok(()),
        Some(n) => {
            let problem = format!("{n} pixels along a side; there must be 1 to {MOST_POINTS}");
            Err(SceneError::invalid(path, "picture", problem))
        }
    }
}

fn read_png(path: &Path) -> Result<Grey, SceneError> {
    let open = SceneError::io(path, "opening the picture");
    let mut reader = image::ImageReader::open(path)
        .map_err(open)?
        .with_guessed_format()
        .map_err(SceneError::io(path, "reading the picture"))?;
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(MOST_POINTS);
    limits.max_image_height = Some(MOST_POINTS);
    reader.limits(limits);
    let picture = reader.decode().map_err(|e| SceneError::invalid(path, "picture", e))?;
    let grey = picture.into_luma16();
    let size = [grey.width(), grey.height()];
    check_size(path, size)?;
    let values = grey.as_raw().iter().map(|v| f32::from(*v) / 65535.0).collect();
    Ok(Grey { size, values })
}

fn read_exr(path: &Path) -> Result<Grey, SceneError> {
    use exr::prelude::{ReadChannels, ReadLayers, read};
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(path)
        .map_err(|e| match e {
            exr::error::Error::Io(source) => SceneError::io(path, "reading the picture")(source),
            other => SceneError::invalid(path, "picture", other),
        })?;
    let layer = &image.layer_data;
    let size = [layer.size.width() as u32, layer.size.height() as u32];
    check_size(path, size)?;
    let channels = &layer.channel_data.list;
    let named = |name: &str| channels.iter().find(|c| c.name.eq_case_insensitive(name));
    let channel = named("Y").or_else(|| named("R")).or(channels.first());
    let channel = channel.ok_or_else(|| SceneError::invalid(path, "picture", "has no channel"))?;
    Ok(Grey { size, values: channel.sample_data.values_as_f32().collect() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sixteen_bits_and_floats_make_the_same_land() {
        let dir = tempfile::tempdir().unwrap();
        let (png, exr) = (dir.path().join("h.png"), dir.path().join("h.exr"));
        let raw: Vec<u16> = vec![0, 13107, 26214, 39321, 52428, 65535];
        let buffer = image::ImageBuffer::<image::Luma<u16>, _>::from_raw(3, 2, raw.clone());
        buffer.unwrap().save(&png).unwrap();
        let value = |x: usize, y: usize| f32::from(raw[y * 3 + x]) / 65535.0;
        exr::prelude::write_rgb_file(&exr, 3, 2, |x, y| (value(x, y), 0.0f32, 0.0f32)).unwrap();
        let lands = [png, exr].map(|p| Grey::read(&p).unwrap().land(40.0, [100.0, 200.0]));
        assert_eq!(lands[0], lands[1]);
        let land = &lands[0];
        assert_eq!((land.points, land.size), ([3, 2], [40.0, 20.0]));
        assert_eq!([land.at(0, 0), land.at(2, 1)], [100.0, 200.0]);
        assert!((land.height(0.0, -10.0) - 120.0).abs() < 1e-4);
    }

    #[test]
    fn samples_lie_between_pixels() {
        let grey = Grey { size: [2, 1], values: vec![0.0, 1.0] };
        for (u, want) in [(0.0, 0.0), (0.25, 0.0), (0.5, 0.5), (1.0, 1.0)] {
            assert_eq!(grey.sample(u, 0.5), want);
        }
    }

    #[test]
    fn what_is_no_picture_is_refused_by_name() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("no.png");
        assert!(Grey::read(&path).unwrap_err().to_string().contains("no.png: opening"));
        std::fs::write(&path, b"no picture").unwrap();
        assert_eq!(Grey::read(&path).unwrap_err().exit_code(), 3);
    }
}
