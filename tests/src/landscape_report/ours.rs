//! Our pictures of a landscape: times, counts and errors.

use crate::truth::Crop;
use anyhow::Result;
use forest_eval::Comparison;
use forest_gpu::{
    Gpu, Landscape, LandscapeDetail, LandscapeDrawn, LandscapeRenderer, LandscapeTarget, Options,
    read_samples,
};
use forest_raster::Picture;
use forest_scene::Scene;
use forest_soup::Camera;
use std::time::Instant;

/// Frames before any is timed.
pub(crate) const WARM_UP: usize = 2;

/// A landscape on the device, with room for a picture.
pub(crate) struct Ours<'s> {
    renderer: LandscapeRenderer,
    landscape: Landscape<'s>,
    target: LandscapeTarget,
    pub(crate) detail: LandscapeDetail,
}

impl<'s> Ours<'s> {
    pub(crate) fn new(gpu: &Gpu, scene: &'s Scene, size: [u32; 2], samples: u32) -> Result<Self> {
        let renderer = LandscapeRenderer::new(gpu, &Options::default())?;
        let landscape = Landscape::load(gpu, &renderer, scene)?;
        let target = LandscapeTarget::new(gpu, &renderer, size, samples)?;
        Ok(Self { renderer, landscape, target, detail: LandscapeDetail::default() })
    }

    /// Draws once; milliseconds and what it took.
    pub(crate) fn frame(&mut self, gpu: &Gpu, camera: &Camera) -> Result<(f64, LandscapeDrawn)> {
        let start = Instant::now();
        let (landscape, target) = (&mut self.landscape, &self.target);
        self.renderer.render(gpu, landscape, target, camera, &self.detail, None);
        gpu.finish()?;
        let ms = start.elapsed().as_secs_f64() * 1e3;
        Ok((ms, self.landscape.drawn(gpu)?))
    }

    /// Linear RGB of the last frame.
    pub(crate) fn picture(&self, gpu: &Gpu) -> Result<Vec<[f32; 3]>> {
        let samples = read_samples(gpu, self.target.samples())?;
        let [width, height] = self.target.samples().size();
        let side = self.target.samples().side();
        Ok(averaged(&samples, width, height, side))
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.landscape.bytes()
    }
}

/// Means over the samples of each pixel.
fn averaged(samples: &[[f32; 4]], width: u32, height: u32, side: u32) -> Vec<[f32; 3]> {
    let share = 1.0 / (side * side) as f32;
    let pixel = |i: u32| {
        let (x, y) = (i % width * side, i / width * side);
        let mut sum = [0.0; 3];
        for s in 0..side * side {
            let row = (y + s / side) * width * side;
            let sample = samples[(row + x + s % side) as usize];
            (0..3).for_each(|k| sum[k] += sample[k] * share);
        }
        sum
    };
    (0..width * height).map(pixel).collect()
}

/// Mean FLIP of a picture `width` pixels wide over crops of the truth.
pub(crate) fn flip(picture: &[[f32; 3]], width: u32, crops: &[Crop], truth: &[Picture]) -> f64 {
    let of = |(crop, truth): (&Crop, &Picture)| {
        let [w, h] = crop.size;
        let mut part = Picture::empty(w, h);
        for (i, pixel) in part.pixels.iter_mut().enumerate() {
            let (x, y) = (crop.corner[0] + i as u32 % w, crop.corner[1] + i as u32 / w);
            let [r, g, b] = picture[(y * width + x) as usize];
            *pixel = [r, g, b, 1.0];
        }
        Comparison::new(truth, &part).flip(0.0).mean()
    };
    crops.iter().zip(truth).map(of).sum::<f64>() / crops.len() as f64
}
