//! FLIP: P. Andersson et al., "ꟻLIP: A Difference Evaluator for Alternating Images", HPG 2020, by
//! the authors' own code.

use super::Framed;
use forest_raster::Picture;
use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageFloat, FlipImageRgb8, magma_lut};

/// Grey pixels around the box: the widest of its filters reaches that far at 67 pixels per degree.
const BORDER: u32 = 10;

/// FLIP of a comparison, pixel by pixel.
pub struct FlipMap {
    width: u32,
    height: u32,
    /// With its border.
    map: FlipImageFloat,
    values: Vec<f32>,
}

impl FlipMap {
    pub(super) fn new(truth: &Picture, test: &Picture, background: f32) -> Self {
        let [a, b] = [truth, test].map(|p| {
            let framed = Framed::new(p, background, BORDER);
            FlipImageRgb8::with_data(framed.width, framed.height, framed.rgb.as_flattened())
        });
        let map = nv_flip::flip(a, b, DEFAULT_PIXELS_PER_DEGREE);
        let values = map.to_vec();
        Self { width: truth.width, height: truth.height, map, values }
    }

    /// Mean over the box; 0 for an empty one.
    pub fn mean(&self) -> f64 {
        let n = f64::from(self.width) * f64::from(self.height);
        let inside = |i: u32| {
            let row = ((i + BORDER) * (self.width + 2 * BORDER) + BORDER) as usize;
            &self.values[row..][..self.width as usize]
        };
        let sum: f64 = (0..self.height).flat_map(inside).map(|&v| f64::from(v)).sum();
        if n > 0.0 { sum / n } else { 0.0 }
    }

    /// The map in the magma colours of the paper, sRGB, row 0 on top: width, height, pixels.
    pub fn heat(&self) -> (u32, u32, Vec<[u8; 3]>) {
        let colors = self.map.apply_color_lut(&magma_lut()).to_vec();
        let (pixels, _) = colors.as_chunks::<3>();
        let rows = (BORDER..BORDER + self.height).flat_map(|y| {
            let first = (y * (self.width + 2 * BORDER) + BORDER) as usize;
            &pixels[first..][..self.width as usize]
        });
        (self.width, self.height, rows.copied().collect())
    }
}
