//! What levels cost on a device.

use crate::device::Gpu;
use crate::error::GpuError;
use crate::frame::{Frame, Layer, What};
use crate::model::Model;
use crate::renderer::Renderer;
use crate::target::Target;
use forest_foliage::Wind;
use forest_points::{PixelArea, Thresholds};
use forest_raster::Light;
use forest_soup::Camera;
use forest_views::Lookup;
use forest_volume::{Blending, Detail};
use std::time::Instant;

/// Milliseconds of a picture, choosing and uploading included.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Costs {
    /// Of a picture of points, and of each point or triangle in it.
    points: [f64; 2],
    /// Of all triangles.
    triangles: f64,
    /// Of each pixel of the box around the tree, by look-up.
    views: [f64; 3],
    /// Of a picture of a volume, and of each billboard in it.
    volume: [f64; 2],
    /// Of a picture of foliage, and of each triangle in it.
    foliage: [f64; 2],
}

/// Pictures that a cost is measured by, after one that warms up.
const ROUNDS: usize = 3;

impl Costs {
    /// Draws a few levels of `model` into `target` and takes their times. `camera` must have the
    /// target's size.
    ///
    /// # Errors
    /// When the device failed.
    pub fn measure(
        gpu: &Gpu,
        renderer: &Renderer,
        model: &mut Model,
        target: &Target,
        camera: &Camera,
    ) -> Result<Self, GpuError> {
        let mut costs = Self::default();
        let time = |model: &mut Model, what: What| -> Result<[f64; 2], GpuError> {
            let layers = [Layer::whole(what)];
            let light = Light::Albedo;
            let wind = Wind::default();
            let frame = Frame { camera: *camera, light, wind, layers: &layers };
            let (mut least, mut primitives) = (f64::INFINITY, 0);
            for round in 0..=ROUNDS {
                let start = Instant::now();
                primitives = renderer.render(gpu, model, target, &frame, None)?.primitives();
                gpu.finish()?;
                // The least: other work on the machine only ever adds.
                if round > 0 {
                    least = least.min(start.elapsed().as_secs_f64() * 1e3);
                }
            }
            Ok([primitives as f64, least])
        };
        if model.points().is_some() {
            let cut = |finest: f64| {
                let largest = PixelArea(Thresholds::LARGEST_RATIO * finest);
                let finest = PixelArea(finest);
                What::Points(Thresholds { finest, largest, depth_bias: PixelArea(0.0) })
            };
            costs.points = line(time(model, cut(64.0))?, time(model, cut(1.0))?);
            costs.triangles = time(model, What::Points(Thresholds::TRIANGLES))?[1];
        }
        if let Some(pixels) = model.views().map(|b| pixels(b, camera)) {
            for (cost, lookup) in costs.views.iter_mut().zip(Lookup::ALL) {
                *cost = time(model, What::Views(0, lookup))?[1] / pixels;
            }
        }
        if let Some(finest) = model.volume().map(|b| b.header.levels.len() as u32 - 1) {
            let level = |l| What::Volume(Detail::Level(l), Blending::Shares);
            let coarse = time(model, level(finest.saturating_sub(3)))?;
            costs.volume = line(coarse, time(model, level(finest.saturating_sub(1)))?);
        }
        if let Some(coarsest) = model.foliage().map(|b| b.header.levels.len() - 1) {
            let coarse = time(model, What::Foliage(coarsest))?;
            costs.foliage = line(coarse, time(model, What::Foliage(0))?);
        }
        Ok(costs)
    }

    /// Expected milliseconds of a level of `primitives` primitives.
    pub(crate) fn of(&self, model: &Model, camera: &Camera, what: &What, primitives: f64) -> f64 {
        let on = |[base, each]: [f64; 2]| base + each * primitives;
        match *what {
            What::Points(t) if t.largest.0 <= 0.0 => self.triangles,
            What::Points(_) => on(self.points),
            // A cell shows the billboards of two cameras.
            What::Volume(..) => on(self.volume) - 0.5 * self.volume[1] * primitives,
            What::Foliage(_) => on(self.foliage),
            What::Views(_, lookup) => {
                let each = Lookup::ALL.iter().zip(self.views).find(|(l, _)| **l == lookup);
                let pixels = model.views().map_or(0.0, |b| pixels(b, camera));
                each.map_or(0.0, |(_, cost)| cost * pixels)
            }
        }
    }
}

/// Pixels of the box around the tree that lie in the picture, and a few that every picture costs.
fn pixels(block: &forest_views::ViewsBlock, camera: &Camera) -> f64 {
    let (low, high) = block.pixels(camera, 0);
    let within = |low: i32, high: i32, size: u32| {
        (high.min(size as i32 - 1) - low.max(0)).saturating_add(1).max(0)
    };
    let (x, y) = (within(low.x, high.x, camera.width), within(low.y, high.y, camera.height));
    f64::from(x) * f64::from(y) + 1e3
}

/// The line through two of (primitives, milliseconds): what none costs, and each; neither below 0.
fn line([n, t]: [f64; 2], [m, s]: [f64; 2]) -> [f64; 2] {
    let each = if m > n { ((s - t) / (m - n)).max(0.0) } else { 0.0 };
    [(t - n * each).max(0.0), each]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_are_a_line_that_never_falls() {
        assert_eq!(line([100.0, 3.0], [300.0, 5.0]), [2.0, 0.01]);
        assert_eq!(line([100.0, 3.0], [300.0, 2.0]), [3.0, 0.0]);
        assert_eq!(line([100.0, 1.0], [200.0, 4.0]), [0.0, 0.03]);
        assert_eq!(line([100.0, 3.0], [100.0, 4.0]), [3.0, 0.0]);
    }
}
