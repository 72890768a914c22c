//! Our pictures of a landscape: times, counts and errors.

use anyhow::Result;
use forest_gpu::{
    Gpu, Landscape, LandscapeDetail, LandscapeDrawn, LandscapeRenderer, LandscapeTarget, Options,
    read_samples,
};
use forest_scene::Scene;
use forest_soup::Camera;
use forest_tests::landscapes::averaged;
use std::time::Instant;

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
