//! A level of points as the subject of captures: views that are small need no triangles.

use crate::points::draw_points;
use forest_points::{PixelArea, PointsBlock, Thresholds};
use forest_raster::{Buffers, Capture, Light, Sampling, Style, Subject};
use forest_soup::Camera;
use std::f64::consts::PI;

/// The points of a pack, at the level whose points are no wider than half a pixel of the capture.
/// They have no share of the sky.
#[derive(Clone, Debug)]
pub struct PointsSubject<'a> {
    block: &'a PointsBlock<'a>,
}

/// Largest projected area of a point in square pixels: a disc of half a pixel across.
const HALF_A_PIXEL: f64 = PI / 16.0;

impl<'a> PointsSubject<'a> {
    /// The points of `block`.
    pub fn new(block: &'a PointsBlock<'a>) -> Self {
        Self { block }
    }
}

impl Subject for PointsSubject<'_> {
    fn capture(&self, camera: &Camera, samples: u32, _: &mut Buffers) -> Capture {
        let thresholds = Thresholds {
            finest: PixelArea(HALF_A_PIXEL),
            largest: PixelArea(f64::INFINITY),
            depth_bias: PixelArea(0.0),
        };
        let sampling = Sampling { side: samples.min(16), seed: 1 };
        let style = Style { sampling, light: Light::Albedo };
        let (picture, _) = draw_points(self.block, None, camera, &thresholds, style);
        Capture { picture, sky: Vec::new() }
    }
}
