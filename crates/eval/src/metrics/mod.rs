//! How far a picture is from the truth.

mod flip;
mod pixels;
mod popping;
mod ssim;

pub use flip::FlipMap;
pub use popping::popping;

use forest_raster::Picture;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Errors of one picture, or their means over several.
///
/// All are taken over the smallest box that holds what either picture shows, so that empty
/// background does not dilute them. Where there is nothing in either picture, they are equal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Errors {
    /// Root mean square difference of premultiplied linear RGBA, `0..=1`.
    pub rmse: f64,
    /// −20·log₁₀(rmse) in dB; null where the pictures are equal.
    pub psnr: Option<f64>,
    /// Structural similarity of the sRGB pictures over the stated grey, up to 1.
    pub ssim: f64,
    /// Mean FLIP of the sRGB pictures over the stated grey at 67 pixels per degree, `0..=1`.
    pub flip: f64,
    /// Mean coverage of the picture minus that of the truth, within the box: does the crown
    /// fatten or thin out?
    pub coverage: f64,
    /// The same over the truth's coverage; null where the truth is empty.
    pub coverage_ratio: Option<f64>,
    /// Σ min / Σ max of both coverages: intersection over union where they are 0 or 1.
    pub silhouette_iou: f64,
    /// Root mean square difference of depth where both cover, in units that the caller states;
    /// null where they have no pixel in common.
    pub depth: Option<f64>,
}

/// Two pictures of one size, cropped to the box that holds what either shows.
#[derive(Clone, Debug)]
pub struct Comparison {
    truth: Picture,
    test: Picture,
}

impl Comparison {
    /// Compares `test` with `truth`.
    ///
    /// # Panics
    /// If their sizes differ.
    pub fn new(truth: &Picture, test: &Picture) -> Self {
        assert_eq!((truth.width, truth.height), (test.width, test.height), "sizes differ");
        let b = PixelBox::around(&[truth, test]);
        Self { truth: b.crop(truth), test: b.crop(test) }
    }

    /// All metrics. Pictures are shown over linear grey `background`; depths are divided by
    /// `depth_unit`.
    pub fn errors(&self, background: f32, depth_unit: f64) -> Errors {
        let pixels = self.pixel_errors(depth_unit);
        Errors { ssim: self.ssim(background), flip: self.flip(background).mean(), ..pixels }
    }

    /// The metrics that look at one pixel at a time; SSIM and FLIP are those of equal pictures.
    pub fn pixel_errors(&self, depth_unit: f64) -> Errors {
        let (a, b) = (&self.truth, &self.test);
        let rmse = pixels::rmse(a, b);
        Errors {
            rmse,
            psnr: (rmse > 0.0).then(|| -20.0 * rmse.log10()),
            ssim: 1.0,
            flip: 0.0,
            coverage: pixels::coverage(a, b),
            coverage_ratio: pixels::coverage_ratio(a, b),
            silhouette_iou: pixels::silhouette_iou(a, b),
            depth: pixels::depth(a, b).map(|d| d / depth_unit),
        }
    }

    /// Structural similarity alone.
    pub fn ssim(&self, background: f32) -> f64 {
        ssim::ssim(&self.truth, &self.test, background)
    }

    /// FLIP pixel by pixel.
    pub fn flip(&self, background: f32) -> FlipMap {
        FlipMap::new(&self.truth, &self.test, background)
    }

    /// The cropped pictures, truth first.
    pub fn pictures(&self) -> (&Picture, &Picture) {
        (&self.truth, &self.test)
    }
}

impl Errors {
    /// Means over several pictures; of what is null somewhere, the mean of the rest. `None` for no
    /// pictures.
    pub fn mean(all: &[Self]) -> Option<Self> {
        let n = all.len() as f64;
        let mean = |of: fn(&Self) -> f64| all.iter().map(of).sum::<f64>() / n;
        let some = |of: fn(&Self) -> Option<f64>| {
            let values: Vec<f64> = all.iter().filter_map(of).collect();
            (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
        };
        (!all.is_empty()).then(|| Self {
            rmse: mean(|e| e.rmse),
            psnr: some(|e| e.psnr),
            ssim: mean(|e| e.ssim),
            flip: mean(|e| e.flip),
            coverage: mean(|e| e.coverage),
            coverage_ratio: some(|e| e.coverage_ratio),
            silhouette_iou: mean(|e| e.silhouette_iou),
            depth: some(|e| e.depth),
        })
    }
}

/// A box of pixels; empty if a side is 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct PixelBox {
    x: u32,
    y: u32,
    width: u32,
    height: u32,
}

impl PixelBox {
    /// The smallest box that holds every covered pixel of all pictures.
    fn around(pictures: &[&Picture]) -> Self {
        let (mut min, mut max) = ([u32::MAX; 2], [0; 2]);
        for p in pictures {
            for (i, _) in (0..).zip(&p.pixels).filter(|(_, v)| v[3] > 0.0) {
                let at = [i % p.width, i / p.width];
                for k in 0..2 {
                    min[k] = min[k].min(at[k]);
                    max[k] = max[k].max(at[k] + 1);
                }
            }
        }
        if min[0] == u32::MAX {
            return Self { x: 0, y: 0, width: 0, height: 0 };
        }
        Self { x: min[0], y: min[1], width: max[0] - min[0], height: max[1] - min[1] }
    }

    fn crop(&self, p: &Picture) -> Picture {
        let mut out = Picture::empty(self.width, self.height);
        for y in 0..self.height {
            let from = ((self.y + y) * p.width + self.x) as usize;
            let (to, n) = ((y * self.width) as usize, self.width as usize);
            out.pixels[to..to + n].copy_from_slice(&p.pixels[from..from + n]);
            out.depth[to..to + n].copy_from_slice(&p.depth[from..from + n]);
            out.normal[to..to + n].copy_from_slice(&p.normal[from..from + n]);
        }
        out
    }
}

/// A picture in 8-bit sRGB over a grey, with `border` pixels of that grey around it: filters that
/// reach out of the box find the background that is there.
struct Framed {
    width: u32,
    height: u32,
    rgb: Vec<[u8; 3]>,
}

impl Framed {
    fn new(p: &Picture, background: f32, border: u32) -> Self {
        let (width, height) = (p.width + 2 * border, p.height + 2 * border);
        let mut rgb =
            vec![[forest_soup::linear_to_srgb8(background); 3]; (width * height) as usize];
        for (y, row) in (0..).zip(p.over(background).chunks(p.width.max(1) as usize)) {
            let first = ((y + border) * width + border) as usize;
            rgb[first..first + row.len()].copy_from_slice(row);
        }
        Self { width, height, rgb }
    }
}

#[cfg(test)]
mod tests;
