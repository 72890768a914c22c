//! The result: premultiplied linear RGBA, depth and normal.

use forest_soup::linear_to_srgb8;

/// A picture of `width × height` pixels, row 0 on top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Linear RGB premultiplied by coverage, and coverage in `0..=1`.
    pub pixels: Vec<[f32; 4]>,
    /// Mean depth along the camera's forward axis of what covers the pixel, in world units;
    /// infinite where nothing does.
    pub depth: Vec<f32>,
    /// Mean over all samples of the unit normal towards the eye, zero where nothing covers: in
    /// world space, premultiplied by coverage.
    pub normal: Vec<[f32; 3]>,
}

impl Picture {
    /// Linear grey that people see a tree before, in files and windows.
    pub const BACKGROUND: f32 = 0.6;

    /// A picture of nothing.
    pub fn empty(width: u32, height: u32) -> Self {
        let n = width as usize * height as usize;
        Self {
            width,
            height,
            pixels: vec![[0.0; 4]; n],
            depth: vec![f32::INFINITY; n],
            normal: vec![[0.0; 3]; n],
        }
    }

    /// Mean of the coverage over all pixels, in `0..=1`; 0 without pixels.
    pub fn mean_coverage(&self) -> f64 {
        let sum: f64 = self.pixels.iter().map(|p| f64::from(p[3])).sum();
        sum / self.pixels.len().max(1) as f64
    }

    /// Every `factor × factor` pixels become their mean. Columns and rows that do not fill a pixel
    /// are left out.
    pub fn box_filtered(&self, factor: u32) -> Self {
        let (width, height) = (self.width / factor, self.height / factor);
        let mut out = Self::empty(width, height);
        let share = 1.0 / (factor * factor) as f32;
        for y in 0..height {
            for x in 0..width {
                let mut mean = PixelMean::default();
                for sy in y * factor..(y + 1) * factor {
                    for sx in x * factor..(x + 1) * factor {
                        let i = (sy * self.width + sx) as usize;
                        mean.add(self.pixels[i], self.depth[i], self.normal[i], share);
                    }
                }
                mean.store(&mut out, (y * width + x) as usize);
            }
        }
        out
    }

    /// 8-bit sRGB pixels over a grey of linear value `background`.
    pub fn over(&self, background: f32) -> Vec<[u8; 3]> {
        let over = |p: &[f32; 4], c: usize| linear_to_srgb8(p[c] + background * (1.0 - p[3]));
        self.pixels.iter().map(|p| [0, 1, 2].map(|c| over(p, c))).collect()
    }

    /// 8-bit sRGB pixels with straight alpha.
    pub fn straight(&self) -> Vec<[u8; 4]> {
        let channel = |p: &[f32; 4], c: usize| {
            if p[3] > 0.0 { linear_to_srgb8(p[c] / p[3]) } else { 0 }
        };
        let alpha = |p: &[f32; 4]| (p[3] * 255.0).round() as u8;
        self.pixels
            .iter()
            .map(|p| [channel(p, 0), channel(p, 1), channel(p, 2), alpha(p)])
            .collect()
    }
}

/// A pixel as it is summed up.
#[derive(Default)]
pub(crate) struct PixelMean {
    pixel: [f64; 4],
    depth: f64,
    normal: [f64; 3],
}

impl PixelMean {
    /// Adds `share` of a pixel or sample.
    #[inline]
    pub(crate) fn add(&mut self, pixel: [f32; 4], depth: f32, normal: [f32; 3], share: f32) {
        if pixel[3] > 0.0 {
            for (sum, v) in self.pixel.iter_mut().zip(pixel) {
                *sum += f64::from(v * share);
            }
            self.depth += f64::from(depth) * f64::from(pixel[3] * share);
            for (sum, v) in self.normal.iter_mut().zip(normal) {
                *sum += f64::from(v * share);
            }
        }
    }

    pub(crate) fn store(self, out: &mut Picture, i: usize) {
        if self.pixel[3] > 0.0 {
            out.pixels[i] = self.pixel.map(|v| v as f32);
            out.depth[i] = (self.depth / self.pixel[3]) as f32;
            out.normal[i] = self.normal.map(|v| v as f32);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn box_filter_weighs_depth_by_coverage() {
        let mut p = Picture::empty(4, 2);
        p.pixels[0] = [0.5, 0.0, 0.0, 1.0];
        p.depth[0] = 2.0;
        p.pixels[5] = [0.0, 0.25, 0.0, 0.5];
        p.depth[5] = 5.0;
        p.normal[5] = [0.0, 0.5, 0.0];
        let half = p.box_filtered(2);
        assert_eq!((half.width, half.height), (2, 1));
        assert_eq!(half.pixels[0], [0.125, 0.0625, 0.0, 0.375]);
        assert!((half.depth[0] - 3.0).abs() < 1e-6); // (2·1 + 5·½) / 1½
        assert_eq!(half.normal[0], [0.0, 0.125, 0.0]);
        assert_eq!((half.pixels[1], half.depth[1]), ([0.0; 4], f32::INFINITY));
    }
}
