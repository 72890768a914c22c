//! The result: premultiplied linear RGBA.

use forest_soup::linear_to_srgb8;

/// A picture of `width × height` pixels, row 0 on top.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Linear RGB premultiplied by coverage, and coverage.
    pub pixels: Vec<[f32; 4]>,
}

impl Picture {
    /// Mean of the coverage over all pixels, in `0..=1`.
    pub fn mean_coverage(&self) -> f64 {
        self.pixels.iter().map(|p| f64::from(p[3])).sum::<f64>() / self.pixels.len() as f64
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
