//! The sample buffer: depth-tested, filled in horizontal bands by all threads.

use crate::picture::Picture;
use crate::primitive::{Primitive, Splat, Triangle};
use crate::style::Style;
use forest_points::covers;
use forest_soup::Camera;
use glam::DVec2;
use rayon::prelude::*;

/// Rows of pixels that one task fills.
const BAND: u32 = 16;

/// The size of a picture in pixels and samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Canvas {
    width: u32,
    height: u32,
    samples: u32,
}

#[derive(Clone, Copy)]
struct Sample {
    depth: f32,
    rgb: [f32; 3],
}

const EMPTY: Sample = Sample { depth: f32::INFINITY, rgb: [0.0; 3] };

/// Samples of a few rows.
struct Band {
    width: u32,
    /// First row of samples.
    top: u32,
    rows: u32,
    samples: Vec<Sample>,
}

impl Canvas {
    /// A canvas for `camera`'s picture.
    pub(crate) fn new(camera: &Camera, style: &Style) -> Self {
        Self { width: camera.width, height: camera.height, samples: style.samples.max(1) }
    }

    /// Samples across a unit of picture coordinates.
    pub(crate) fn scale(&self) -> f64 {
        f64::from(self.samples)
    }

    /// Draws the primitives in any order: the nearest one wins each sample, the earlier one among
    /// equals.
    pub(crate) fn render(&self, primitives: &[Primitive]) -> Picture {
        let bands = self.height.div_ceil(BAND);
        let mut lists = vec![Vec::new(); bands as usize];
        for (i, p) in (0u32..).zip(primitives) {
            let (top, bottom) = p.rows();
            let rows = f64::from(BAND * self.samples);
            if bottom < 0.0 || top >= f64::from(self.height * self.samples) {
                continue;
            }
            let first = (top.max(0.0) / rows) as usize;
            let last = ((bottom / rows) as usize).min(lists.len() - 1);
            lists[first..=last].iter_mut().for_each(|l| l.push(i));
        }
        let pixels: Vec<[f32; 4]> = lists
            .par_iter()
            .zip(0u32..bands)
            .flat_map_iter(|(list, b)| {
                let rows = BAND.min(self.height - b * BAND);
                let mut band = Band::new(self, b * BAND, rows);
                for &i in list {
                    match &primitives[i as usize] {
                        Primitive::Splat(s) => band.splat(s),
                        Primitive::Triangle(t) => band.triangle(t),
                    }
                }
                band.resolve(self.samples)
            })
            .collect();
        Picture { width: self.width, height: self.height, pixels }
    }
}

impl Primitive<'_> {
    /// Topmost and bottommost row of samples it may touch.
    fn rows(&self) -> (f64, f64) {
        match self {
            Primitive::Splat(s) => {
                let (middle, half) = (s.footprint.center.y, s.footprint.half_size().y);
                (middle - half, middle + half)
            }
            Primitive::Triangle(t) => {
                let y = t.corners.map(|c| c.y);
                (y[0].min(y[1]).min(y[2]), y[0].max(y[1]).max(y[2]))
            }
        }
    }
}

impl Band {
    fn new(canvas: &Canvas, first_pixel_row: u32, pixel_rows: u32) -> Self {
        let width = canvas.width * canvas.samples;
        let rows = pixel_rows * canvas.samples;
        let samples = vec![EMPTY; width as usize * rows as usize];
        Self { width, top: first_pixel_row * canvas.samples, rows, samples }
    }

    /// Visits the samples of a box: their middle, their coordinates, their place.
    fn visit(
        &mut self,
        min: DVec2,
        max: DVec2,
        mut each: impl FnMut(DVec2, u32, u32, &mut Sample),
    ) {
        // The first sample whose middle (at +½) is inside, and the one after the last.
        let range = |lo: f64, hi: f64, from: u32, to: u32| {
            let first = (lo - 0.5).ceil().clamp(f64::from(from), f64::from(to)) as u32;
            let end = ((hi - 0.5).floor() + 1.0).clamp(f64::from(from), f64::from(to)) as u32;
            first..end.max(first)
        };
        for y in range(min.y, max.y, self.top, self.top + self.rows) {
            for x in range(min.x, max.x, 0, self.width) {
                let slot = (y - self.top) as usize * self.width as usize + x as usize;
                let middle = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                each(middle, x, y, &mut self.samples[slot]);
            }
        }
    }

    fn splat(&mut self, s: &Splat) {
        let (f, half, depth) = (s.footprint, s.footprint.half_size(), s.depth as f32);
        self.visit(f.center - half, f.center + half, |p, x, y, sample| {
            if depth < sample.depth && f.contains(p) && covers(s.id, x, y, s.opacity) {
                *sample = Sample { depth, rgb: s.rgb };
            }
        });
    }

    fn triangle(&mut self, t: &Triangle) {
        let [a, b, c] = t.corners;
        self.visit(a.min(b).min(c), a.max(b).max(c), |p, x, y, sample| {
            if let Some((depth, rgb)) = t.shade(p, x, y)
                && (depth as f32) < sample.depth
            {
                *sample = Sample { depth: depth as f32, rgb };
            }
        });
    }

    /// Box-filters samples to pixels.
    fn resolve(self, samples: u32) -> Vec<[f32; 4]> {
        let (s, width) = (samples as usize, self.width as usize);
        let share = 1.0 / (s * s) as f32;
        let mut pixels = Vec::with_capacity(self.samples.len() / (s * s));
        for rows in self.samples.chunks(width * s) {
            for x in (0..width).step_by(s) {
                let mut sum = [0.0; 4];
                let block = (0..s).flat_map(|j| &rows[j * width + x..][..s]);
                for sample in block.filter(|v| v.depth < f32::INFINITY) {
                    let [r, g, b] = sample.rgb;
                    for (sum, v) in sum.iter_mut().zip([r, g, b, 1.0]) {
                        *sum += v * share;
                    }
                }
                pixels.push(sum);
            }
        }
        pixels
    }
}
