//! Textures with mips whose alpha test covers as much as the whole picture does (I. Castaño, "Computing
//! alpha mipmaps", 2010), and colours that are bled into what is transparent.

use forest_gpu::Gpu;
use forest_soup::{linear_to_srgb8, srgb8_to_linear};
use wgpu::{
    Extent3d, Origin3d, TexelCopyBufferLayout, TexelCopyTextureInfo, Texture, TextureAspect,
    TextureDescriptor, TextureDimension, TextureFormat, TextureUsages,
};

/// A picture of straight linear RGBA.
#[derive(Clone, Debug)]
pub(crate) struct Level {
    pub(crate) size: [u32; 2],
    pub(crate) texels: Vec<[f32; 4]>,
}

impl Level {
    /// Half as large, colours weighted by alpha.
    fn halved(&self) -> Self {
        let [w, h] = self.size;
        let size = self.size.map(|n| (n / 2).max(1));
        let texel = |i: u32| {
            let (x, y) = (i % size[0] * 2, i / size[0] * 2);
            let mut sum = [0.0f32; 4];
            let mut plain = [0.0f32; 3];
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let (x, y) = ((x + dx).min(w - 1), (y + dy).min(h - 1));
                let t = self.texels[(y * w + x) as usize];
                (0..3).for_each(|k| sum[k] += t[k] * t[3]);
                (0..3).for_each(|k| plain[k] += t[k] * 0.25);
                sum[3] += t[3];
            }
            match sum[3] > 0.0 {
                true => [sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3], sum[3] * 0.25],
                false => [plain[0], plain[1], plain[2], 0.0],
            }
        };
        Self { size, texels: (0..size[0] * size[1]).map(texel).collect() }
    }

    /// Share of texels that pass the test when alpha is scaled.
    fn passing(&self, cutoff: f32, scale: f32) -> f32 {
        let pass = self.texels.iter().filter(|t| t[3] * scale >= cutoff).count();
        pass as f32 / self.texels.len() as f32
    }

    /// Scales alpha so that a share `wanted` passes the test, as nearly as it can.
    fn cover(&mut self, cutoff: f32, wanted: f32) {
        let (mut low, mut high) = (0.0f32, 16.0f32);
        for _ in 0..24 {
            let middle = 0.5 * (low + high);
            match self.passing(cutoff, middle) < wanted {
                true => low = middle,
                false => high = middle,
            }
        }
        for t in &mut self.texels {
            t[3] = (t[3] * high).min(1.0);
        }
    }
}

/// What alpha means to the test.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Coverage {
    /// Nothing.
    Opaque,
    /// The largest level is right.
    Tested(f32),
    /// Alpha of the largest level is coverage, and the test must pass so much of it on average.
    Mean(f32),
}

/// Texels of the shorter side of the smallest level whose alpha is tested: in fewer there are too few
/// shares, and small leaves would become whole squares.
const LEAST_TESTED: u32 = 16;

/// The level and smaller ones.
pub(crate) fn mips(first: Level, coverage: Coverage) -> Vec<Level> {
    let tested = !matches!(coverage, Coverage::Opaque);
    let is_last = |l: &Level| match tested {
        true => l.size.iter().any(|n| *n < 2 * LEAST_TESTED),
        false => l.size == [1, 1],
    };
    let mut levels = vec![first];
    while let Some(last) = levels.last().filter(|l| !is_last(l)) {
        levels.push(last.halved());
    }
    for i in (0..levels.len() - 1).rev() {
        let (fine, coarse) = levels.split_at_mut(i + 1);
        let (fine, coarse) = (&mut fine[i], &coarse[0]);
        for (k, t) in (0..).zip(&mut fine.texels).filter(|(_, t)| t[3] == 0.0) {
            let x = (k % fine.size[0] / 2).min(coarse.size[0] - 1);
            let y = (k / fine.size[0] / 2).min(coarse.size[1] - 1);
            let c = coarse.texels[(y * coarse.size[0] + x) as usize];
            (t[0], t[1], t[2]) = (c[0], c[1], c[2]);
        }
    }
    match coverage {
        Coverage::Opaque => {}
        Coverage::Tested(cutoff) => {
            let wanted = levels[0].passing(cutoff, 1.0);
            levels[1..].iter_mut().for_each(|l| l.cover(cutoff, wanted));
        }
        Coverage::Mean(cutoff) => {
            let all = &levels[0].texels;
            let wanted = all.iter().map(|t| t[3]).sum::<f32>() / all.len() as f32;
            levels.iter_mut().for_each(|l| l.cover(cutoff, wanted));
        }
    }
    levels
}

/// The source's texture.
pub(crate) fn linear(texture: &forest_soup::Texture) -> Level {
    let texel = |t: &[u8; 4]| {
        let [r, g, b] = [t[0], t[1], t[2]].map(srgb8_to_linear);
        [r, g, b, f32::from(t[3]) / 255.0]
    };
    Level {
        size: [texture.width, texture.height],
        texels: texture.texels.iter().map(texel).collect(),
    }
}

/// An array of pictures of one size with their mips: sRGB colours, or numbers of 0 … 1 as they are.
/// And its bytes.
pub(crate) fn upload(gpu: &Gpu, layers: &[Vec<Level>], srgb: bool) -> (Texture, u64) {
    let [width, height] = layers[0][0].size;
    let count = layers.len() as u32;
    let texture = gpu.device.create_texture(&TextureDescriptor {
        label: Some("pictures"),
        size: Extent3d { width, height, depth_or_array_layers: count },
        mip_level_count: layers[0].len() as u32,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format: if srgb { TextureFormat::Rgba8UnormSrgb } else { TextureFormat::Rgba8Unorm },
        usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
        view_formats: &[],
    });
    let code = |v: f32| (v.clamp(0.0, 1.0) * 255.0).round() as u8;
    let color = |v: f32| if srgb { linear_to_srgb8(v) } else { code(v) };
    let mut total = 0;
    for (z, levels) in (0..).zip(layers) {
        for (mip_level, level) in (0..).zip(levels) {
            let texel = |t: &[f32; 4]| [color(t[0]), color(t[1]), color(t[2]), code(t[3])];
            let bytes: Vec<u8> = level.texels.iter().flat_map(texel).collect();
            total += bytes.len() as u64;
            let [width, height] = level.size;
            gpu.queue.write_texture(
                TexelCopyTextureInfo {
                    texture: &texture,
                    mip_level,
                    origin: Origin3d { x: 0, y: 0, z },
                    aspect: TextureAspect::All,
                },
                &bytes,
                TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(width * 4),
                    rows_per_image: Some(height),
                },
                Extent3d { width, height, depth_or_array_layers: 1 },
            );
        }
    }
    (texture, total)
}
