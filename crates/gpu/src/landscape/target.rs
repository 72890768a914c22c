//! What landscapes are drawn into.

use crate::bind;
use crate::device::Gpu;
use crate::error::GpuError;
use crate::landscape::{BLOCK, LandscapeRenderer, MOST_NEARNESS, PROBE};
use crate::target::Target;
use wgpu::{BindGroup, BindingResource, Buffer, BufferUsages, TextureView};

/// A picture of a landscape: samples, and the pyramid of what is covered.
#[derive(Debug)]
pub struct LandscapeTarget {
    pub(crate) samples: Target,
    pub(crate) nearness: Buffer,
    /// Words of the pyramid's head and of all its levels.
    pub(crate) head: Vec<u32>,
    pub(crate) start: BindGroup,
    pub(crate) near: BindGroup,
    pub(crate) found: BindGroup,
    pub(crate) depth: TextureView,
    /// Blocks of the finest level.
    pub(crate) blocks: [u32; 2],
}

impl LandscapeTarget {
    /// Room for a picture of `size` pixels with `side` × `side` samples each.
    ///
    /// # Errors
    /// When the device does not take so many.
    pub fn new(
        gpu: &Gpu,
        renderer: &LandscapeRenderer,
        size: [u32; 2],
        side: u32,
    ) -> Result<Self, GpuError> {
        let samples = Target::new(gpu, &renderer.targets, size, side.clamp(1, 16))?;
        let [width, height] = size.map(|n| n.max(1) * samples.side());
        let (head, count) = pyramid([width, height]);
        let bytes = (head.len() + count as usize) as u64 * 4;
        let nearness = gpu.buffer("nearness", bytes, BufferUsages::STORAGE)?;
        let group =
            |label, layout, all: &[BindingResource]| bind::group(&gpu.device, label, layout, all);
        let kept = samples.kept.as_entire_binding();
        let read = samples.depth.create_view(&Default::default());
        let start = [kept.clone(), BindingResource::TextureView(&read)];
        let layouts = &renderer.layouts;
        gpu.check()?;
        Ok(Self {
            start: group("samples to start", &layouts.start, &start),
            near: group(
                "samples and nearness",
                &layouts.near,
                &[kept.clone(), nearness.as_entire_binding()],
            ),
            found: group("samples found", &layouts.found, &[kept]),
            depth: samples.depth.create_view(&Default::default()),
            blocks: [width.div_ceil(BLOCK), height.div_ceil(BLOCK)],
            head,
            nearness,
            samples,
        })
    }

    /// The samples, to be shown or read.
    pub fn samples(&self) -> &Target {
        &self.samples
    }
}

/// The levels of the pyramid over so many samples: blocks across and down, first block, zero; then the
/// probes. And how many values all have.
fn pyramid(size: [u32; 2]) -> (Vec<u32>, u32) {
    let mut across = size.map(|n| n.div_ceil(BLOCK));
    let (mut head, mut first) = (Vec::with_capacity(4 * MOST_NEARNESS), 0);
    for _ in 1..MOST_NEARNESS {
        head.extend([across[0], across[1], first, 0]);
        first += across[0] * across[1];
        across = across.map(|n| n.div_ceil(2));
    }
    let probes = size.map(|n| n.div_ceil(PROBE));
    head.extend([probes[0], probes[1], first, 0]);
    (head, first + probes[0] * probes[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_halve_and_do_not_overlap() {
        let (head, count) = pyramid([1280, 720]);
        assert_eq!(head[..3], [320, 180, 0]);
        assert_eq!(head[4..7], [160, 90, 57_600]);
        assert_eq!(head[8..11], [80, 45, 72_000]);
        assert_eq!(head[24..27], [5, 3, 76_820]);
        assert_eq!((&head[28..31], count), (&[640, 360, 76_835][..], 76_835 + 230_400));
    }
}
