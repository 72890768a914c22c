//! Translucent layers, one over the other: what sorted volumes are drawn with.

use crate::picture::Picture;
use crate::sampling::{Pattern, Sampling};
use forest_soup::Camera;
use glam::IVec2;
use rayon::prelude::*;

/// A translucent thing, parallel to the picture.
pub trait Layer: Sync {
    /// First and last pixel of the box around it.
    fn pixels(&self) -> (IVec2, IVec2);

    /// Distance along the camera's forward axis, in world units.
    fn depth(&self) -> f64;

    /// Premultiplied linear RGBA at picture coordinates (x, y).
    fn sample(&self, x: f64, y: f64) -> [f32; 4];
}

/// Samples of a band: they take about 24 MB.
const BAND_SAMPLES: usize = 1 << 20;

/// What shines through where nothing behind is looked at any more.
const OPAQUE: f32 = 1.0 / 4096.0;

/// What has been met at a sample.
#[derive(Clone, Copy)]
struct Sample {
    rgb: [f32; 3],
    depth: f32,
    /// Share of the light from behind that still comes through.
    through: f32,
}

/// Draws `layers`, given from back to front, each *over* what is behind it (T. Porter, T. Duff,
/// "Compositing digital images", 1984), at the samples that the canvas takes too. Normals point at
/// the eye.
pub fn composite<L: Layer>(layers: &[L], camera: &Camera, sampling: Sampling) -> Picture {
    if camera.width == 0 || camera.height == 0 {
        return Picture::empty(camera.width, camera.height);
    }
    let pattern = Pattern::new(sampling);
    let row = (camera.width as usize * pattern.count()).max(1);
    let share = camera.height.div_ceil(2 * rayon::current_num_threads() as u32).max(1);
    let rows = ((BAND_SAMPLES / row) as u32).clamp(1, share.min(16));
    let mut bins = vec![Vec::new(); camera.height.div_ceil(rows) as usize];
    // From front to back: what is hidden need not be looked at.
    for (i, layer) in layers.iter().enumerate().rev() {
        let (min, max) = layer.pixels();
        if max.y >= 0 && min.y < camera.height as i32 && max.x >= 0 && min.x < camera.width as i32 {
            let first = min.y.max(0) as usize / rows as usize;
            let last = (max.y as usize / rows as usize).min(bins.len() - 1);
            bins[first..=last].iter_mut().for_each(|b| b.push(i as u32));
        }
    }
    let bands: Vec<Picture> = bins
        .into_par_iter()
        .enumerate()
        .map(|(b, bin)| {
            let top = b as u32 * rows;
            let size = [camera.width, rows.min(camera.height - top)];
            let mut samples =
                vec![Sample::NONE; size[0] as usize * size[1] as usize * pattern.count()];
            for i in bin {
                put(&layers[i as usize], &pattern, top, size, &mut samples);
            }
            resolve(&samples, pattern.count(), size, camera)
        })
        .collect();
    let mut out = Picture { width: camera.width, height: camera.height, ..Picture::empty(0, 0) };
    for band in bands {
        out.pixels.extend(band.pixels);
        out.depth.extend(band.depth);
        out.normal.extend(band.normal);
    }
    out
}

impl Sample {
    const NONE: Self = Self { rgb: [0.0; 3], depth: 0.0, through: 1.0 };
}

fn put<L: Layer>(layer: &L, pattern: &Pattern, top: u32, size: [u32; 2], samples: &mut [Sample]) {
    let (min, max) = layer.pixels();
    let depth = layer.depth() as f32;
    let end = |max: i32, size: u32| (i64::from(max) + 1).clamp(0, i64::from(size)) as u32;
    for y in (min.y.max(top as i32) as u32)..end(max.y, top + size[1]) {
        for x in (min.x.max(0) as u32)..end(max.x, size[0]) {
            let (xs, ys) = pattern.pixel(x, y);
            let first = ((y - top) * size[0] + x) as usize * pattern.count();
            for (s, sample) in samples[first..][..pattern.count()].iter_mut().enumerate() {
                if sample.through < OPAQUE {
                    continue;
                }
                let at = (f64::from(x) + f64::from(xs[s]), f64::from(y) + f64::from(ys[s]));
                let [r, g, b, a] = layer.sample(at.0, at.1);
                for (sum, v) in sample.rgb.iter_mut().zip([r, g, b]) {
                    *sum += sample.through * v;
                }
                sample.depth += sample.through * a * depth;
                sample.through *= 1.0 - a;
            }
        }
    }
}

fn resolve(samples: &[Sample], count: usize, size: [u32; 2], camera: &Camera) -> Picture {
    let mut out = Picture::empty(size[0], size[1]);
    let normal = -camera.forward.as_vec3();
    for (i, samples) in samples.chunks_exact(count).enumerate() {
        let mut sum = [0.0f64; 5];
        for s in samples {
            let alpha = 1.0 - s.through;
            for (to, v) in sum.iter_mut().zip([s.rgb[0], s.rgb[1], s.rgb[2], alpha, s.depth]) {
                *to += f64::from(v);
            }
        }
        let [r, g, b, alpha, depth] = sum.map(|v| v / count as f64);
        if alpha > 0.0 {
            out.pixels[i] = [r, g, b, alpha].map(|v| v as f32);
            out.depth[i] = (depth / alpha) as f32;
            out.normal[i] = (normal * alpha as f32).to_array();
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use forest_soup::Projection;
    use glam::DVec3;

    struct Square {
        pixels: [i32; 2],
        depth: f64,
        color: [f32; 4],
    }

    impl Layer for Square {
        fn pixels(&self) -> (IVec2, IVec2) {
            (IVec2::splat(self.pixels[0]), IVec2::splat(self.pixels[1] - 1))
        }

        fn depth(&self) -> f64 {
            self.depth
        }

        fn sample(&self, _: f64, _: f64) -> [f32; 4] {
            self.color
        }
    }

    #[test]
    fn over_by_hand() {
        let layers = [
            Square { pixels: [-3, 3], depth: 5.0, color: [0.0, 0.8, 0.0, 0.8] },
            Square { pixels: [2, 90], depth: 2.0, color: [0.5, 0.0, 0.0, 0.5] },
        ];
        let projection = Projection::Orthographic { height: 1.0 };
        let camera = Camera::new(DVec3::ZERO, -DVec3::Z, projection, [5, 4]);
        let picture = composite(&layers, &camera, Sampling { side: 4, seed: 1 });
        assert_eq!(picture.pixels[0], [0.0, 0.8, 0.0, 0.8]);
        assert_eq!(picture.pixels[3], [0.0; 4]);
        assert_eq!(picture.pixels[3 * 5 + 4], [0.5, 0.0, 0.0, 0.5]);
        // Half red over the green's remaining half.
        let both = picture.pixels[2 * 5 + 2];
        for (got, want) in both.iter().zip([0.5, 0.4, 0.0, 0.9]) {
            assert!((got - want).abs() < 1e-6, "{both:?}");
        }
        let depth = picture.depth[2 * 5 + 2];
        assert!((depth - (0.5 * 2.0 + 0.4 * 5.0) / 0.9).abs() < 1e-5, "{depth}");
    }
}
