//! A texture as light sees it: linear, premultiplied by coverage, with every coarser level.

use crate::{AlphaMode, Material, Texture, Wrap, color::srgb8_to_linear};
use glam::Vec2;
use rayon::prelude::*;

/// Full scale of the stored channels.
const ONE: f32 = 65535.0;

/// Base colour texture × base colour factor, in linear light, premultiplied by coverage, as a
/// pyramid whose every level has the same mean.
///
/// Under [`AlphaMode::Mask`] a texel of level 0 holds the share of it in which the bilinear alpha
/// passes the cutoff, so that averaging (mips, integrals) keeps the area that an alpha test at
/// infinite resolution would show.
#[derive(Clone, Debug)]
pub struct ShadedTexture {
    levels: Vec<Level>,
    wrap: [Wrap; 2],
    translucent: bool,
}

#[derive(Clone, Debug)]
struct Level {
    width: u32,
    height: u32,
    texels: Vec<[u16; 4]>,
}

impl ShadedTexture {
    /// Shades `texture` by `material`'s base colour and alpha rule.
    pub fn new(texture: &Texture, material: &Material) -> Self {
        let coverage = CoverageRule::new(texture, material);
        let (w, h) = (texture.width, texture.height);
        let scale: [f32; 3] = std::array::from_fn(|c| material.base_color[c] * ONE);
        let lut: Vec<[f32; 3]> =
            (0..=255).map(|c| scale.map(|s| (srgb8_to_linear(c) * s).min(ONE))).collect();
        let mut texels = vec![[0u16; 4]; texture.texels.len()];
        texels.par_chunks_mut(w as usize).enumerate().for_each(|(y, row)| {
            let source = &texture.texels[y * w as usize..][..w as usize];
            for (x, (out, &[r, g, b, _])) in row.iter_mut().zip(source).enumerate() {
                let a = coverage.of_texel(x as u32, y as u32);
                let rgb = [lut[r as usize][0], lut[g as usize][1], lut[b as usize][2]];
                *out = [rgb[0] * a, rgb[1] * a, rgb[2] * a, a * ONE].map(|v| (v + 0.5) as u16);
            }
        });
        let translucent = texels.par_iter().any(|t| t[3] != u16::MAX);
        let levels = with_coarser(Level { width: w, height: h, texels });
        Self { levels, wrap: texture.wrap, translucent }
    }

    /// A texture of numbers, not of colours: no curve, no coverage.
    pub(crate) fn data(texture: &Texture) -> Self {
        let wide = |t: &[u8; 4]| [t[0], t[1], t[2], u8::MAX].map(|v| u16::from(v) * 257);
        let texels = texture.texels.par_iter().map(wide).collect();
        let finest = Level { width: texture.width, height: texture.height, texels };
        Self { levels: with_coarser(finest), wrap: texture.wrap, translucent: false }
    }

    /// Texels of the finest level.
    pub fn texels(&self) -> f32 {
        self.levels[0].texels.len() as f32
    }

    /// The coverage of all levels, in 8 bits.
    pub(crate) fn coverage_levels(&self) -> Vec<crate::coverage::Level> {
        let coverage = |t: &[u16; 4]| (f32::from(t[3]) * (255.0 / ONE)).round() as u8;
        let level = |l: &Level| crate::coverage::Level {
            width: l.width,
            height: l.height,
            texels: l.texels.par_iter().map(coverage).collect(),
        };
        self.levels.iter().map(level).collect()
    }

    /// Whether any texel is not fully covered.
    pub fn is_translucent(&self) -> bool {
        self.translucent
    }

    /// Bilinear sample of the finest level: premultiplied linear RGBA in `0..=1`.
    pub fn sample(&self, uv: Vec2) -> [f32; 4] {
        self.sample_level(0, uv)
    }

    /// Bilinear sample of the level whose texels are nearest to `texels` of the finest in area.
    pub fn sample_area(&self, uv: Vec2, texels: f32) -> [f32; 4] {
        let level = (0.5 * texels.max(1.0).log2()).round() as usize;
        self.sample_level(level.min(self.levels.len() - 1), uv)
    }

    /// Alpha of [`ShadedTexture::sample`], without the rest.
    #[inline]
    pub fn sample_alpha(&self, uv: Vec2) -> f32 {
        let l = &self.levels[0];
        let Bilinear { columns: [xa, xb], rows: [ya, yb], fx, fy } =
            Bilinear::new(l, self.wrap, uv);
        let at = |x: usize, y: usize| f32::from(l.texels[y * l.width as usize + x][3]);
        let top = at(xa, ya) * (1.0 - fx) + at(xb, ya) * fx;
        let bottom = at(xa, yb) * (1.0 - fx) + at(xb, yb) * fx;
        (top * (1.0 - fy) + bottom * fy) * (1.0 / ONE)
    }

    /// Mean over the triangle `uv` of the texture: premultiplied linear RGBA in `0..=1`.
    ///
    /// The triangle is bisected across its longest edge, in texels, until its equal parts are
    /// texel-sized or there are 2^`max_depth` of them; each is sampled at its centroid, from the
    /// level whose texels are as large as the part.
    pub fn integrate(&self, uv: [Vec2; 3], max_depth: u32) -> [f32; 4] {
        let size = Vec2::new(self.levels[0].width as f32, self.levels[0].height as f32);
        let [a, b, c] = uv.map(|p| p * size);
        let texels = 0.5 * (b - a).perp_dot(c - a).abs();
        let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a));
        // Slivers need samples along their length although they have no area.
        let depth = (texels.max(longest.sqrt()).log2().ceil() as u32).min(max_depth);
        let parts = (1u32 << depth) as f32;
        let level = (0.5 * (texels / parts).log2()).round().max(0.0) as usize;
        let level = level.min(self.levels.len() - 1);
        let mut sum = [0.0; 4];
        self.sum_parts([a, b, c], depth, level, size.recip(), &mut sum);
        sum.map(|s| s / parts)
    }

    fn sum_parts(&self, t: [Vec2; 3], depth: u32, level: usize, to_uv: Vec2, sum: &mut [f32; 4]) {
        let [a, b, c] = t;
        if depth == 0 {
            let sample = self.sample_level(level, (a + b + c) * to_uv / 3.0);
            for (s, v) in sum.iter_mut().zip(sample) {
                *s += v;
            }
            return;
        }
        let (ab, bc, ca) = (a.distance_squared(b), b.distance_squared(c), c.distance_squared(a));
        // Turn the triangle so that its longest edge comes first.
        let [a, b, c] = if ab >= bc && ab >= ca {
            [a, b, c]
        } else if bc >= ca {
            [b, c, a]
        } else {
            [c, a, b]
        };
        let middle = (a + b) * 0.5;
        self.sum_parts([a, middle, c], depth - 1, level, to_uv, sum);
        self.sum_parts([middle, b, c], depth - 1, level, to_uv, sum);
    }

    fn sample_level(&self, level: usize, uv: Vec2) -> [f32; 4] {
        let l = &self.levels[level];
        let Bilinear { columns: [xa, xb], rows: [ya, yb], fx, fy } =
            Bilinear::new(l, self.wrap, uv);
        let row = |y: usize| &l.texels[y * l.width as usize..][..l.width as usize];
        let (top, bottom) = (row(ya), row(yb));
        std::array::from_fn(|c| {
            let t = f32::from(top[xa][c]) * (1.0 - fx) + f32::from(top[xb][c]) * fx;
            let b = f32::from(bottom[xa][c]) * (1.0 - fx) + f32::from(bottom[xb][c]) * fx;
            (t * (1.0 - fy) + b * fy) * (1.0 / ONE)
        })
    }
}

/// The four texels around a place, and how far it is from the first towards the last.
struct Bilinear {
    columns: [usize; 2],
    rows: [usize; 2],
    fx: f32,
    fy: f32,
}

impl Bilinear {
    #[inline]
    fn new(level: &Level, [wx, wy]: [Wrap; 2], uv: Vec2) -> Self {
        let (w, h) = (level.width, level.height);
        let x = uv.x * w as f32 - 0.5;
        let y = uv.y * h as f32 - 0.5;
        let (x0, y0) = (x.floor(), y.floor());
        // `as i64` saturates: a hostile 1e30 coordinate stays a valid index.
        let (ix, iy) = (x0 as i64, y0 as i64);
        Self {
            columns: [wx.index(ix, w), wx.index(ix.saturating_add(1), w)],
            rows: [wy.index(iy, h), wy.index(iy.saturating_add(1), h)],
            fx: x - x0,
            fy: y - y0,
        }
    }
}

/// All levels down to a single texel, finest first.
fn with_coarser(finest: Level) -> Vec<Level> {
    let mut levels = vec![finest];
    while let Some(next) = levels.last().and_then(Level::halved) {
        levels.push(next);
    }
    levels
}

impl Level {
    /// The next coarser level by area-weighted averaging; `None` at 1×1.
    fn halved(&self) -> Option<Level> {
        if self.width == 1 && self.height == 1 {
            return None;
        }
        let (w, h) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let columns: Vec<_> = (0..w).map(|x| spans(x, self.width, w)).collect();
        let mut texels = vec![[0u16; 4]; w as usize * h as usize];
        texels.par_chunks_mut(w as usize).enumerate().for_each(|(y, row)| {
            let rows = spans(y as u32, self.height, h);
            for (out, columns) in row.iter_mut().zip(&columns) {
                let mut sum = [0.0f32; 4];
                for &(sy, wy) in rows.iter().filter(|r| r.1 > 0.0) {
                    let source = &self.texels[sy as usize * self.width as usize..];
                    for &(sx, wx) in columns.iter().filter(|c| c.1 > 0.0) {
                        let texel = source[sx as usize];
                        for c in 0..4 {
                            sum[c] += f32::from(texel[c]) * (wx * wy);
                        }
                    }
                }
                *out = sum.map(|s| (s + 0.5) as u16);
            }
        });
        Some(Level { width: w, height: h, texels })
    }
}

/// The source texels under destination texel `i` of `dst`, with their shares of it. Halving covers
/// at most three texels (an odd size, or 1 → 1).
fn spans(i: u32, src: u32, dst: u32) -> [(u32, f32); 3] {
    let ratio = f64::from(src) / f64::from(dst);
    let (from, to) = (f64::from(i) * ratio, f64::from(i + 1) * ratio);
    let first = from.floor() as u32;
    std::array::from_fn(|k| {
        let s = first + k as u32;
        let share = (to.min(f64::from(s + 1)) - from.max(f64::from(s))).max(0.0) / ratio;
        if s < src { (s, share as f32) } else { (src - 1, 0.0) }
    })
}

/// How much of a texel is covered.
enum CoverageRule<'a> {
    Full,
    Alpha { texture: &'a Texture, factor: f32 },
    Cutoff { texture: &'a Texture, cutoff: f32 },
}

impl<'a> CoverageRule<'a> {
    fn new(texture: &'a Texture, material: &Material) -> Self {
        let factor = material.base_color[3];
        match material.alpha_mode {
            AlphaMode::Opaque => CoverageRule::Full,
            AlphaMode::Blend => CoverageRule::Alpha { texture, factor: factor / 255.0 },
            // factor · alpha ≥ cutoff, on the 0..=255 scale; a zero factor passes only a zero cutoff.
            AlphaMode::Mask { cutoff } if factor > 0.0 => {
                CoverageRule::Cutoff { texture, cutoff: cutoff / factor * 255.0 }
            }
            AlphaMode::Mask { cutoff } if cutoff <= 0.0 => CoverageRule::Full,
            AlphaMode::Mask { .. } => CoverageRule::Cutoff { texture, cutoff: f32::INFINITY },
        }
    }

    fn of_texel(&self, x: u32, y: u32) -> f32 {
        match *self {
            CoverageRule::Full => 1.0,
            CoverageRule::Alpha { texture, factor } => {
                let i = y as usize * texture.width as usize + x as usize;
                (f32::from(texture.texels[i][3]) * factor).clamp(0.0, 1.0)
            }
            CoverageRule::Cutoff { texture, cutoff } => share_above(texture, x, y, cutoff),
        }
    }
}

/// Sub-samples a side in a texel that the cutoff crosses.
const SUB: usize = 8;

/// The share of texel `(x, y)` in which the bilinear alpha is ≥ `cutoff` (0..=255 scale).
fn share_above(texture: &Texture, x: u32, y: u32, cutoff: f32) -> f32 {
    let (w, h) = (texture.width, texture.height);
    let column = |dx: i64| texture.wrap[0].index(i64::from(x) + dx, w);
    let columns = [column(-1), x as usize, column(1)];
    let mut alpha = [[0.0f32; 3]; 3];
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    for (dy, row) in alpha.iter_mut().enumerate() {
        let sy = texture.wrap[1].index(i64::from(y) + dy as i64 - 1, h);
        let source = &texture.texels[sy * w as usize..][..w as usize];
        for (a, &sx) in row.iter_mut().zip(&columns) {
            *a = f32::from(source[sx][3]);
            low = low.min(*a);
            high = high.max(*a);
        }
    }
    if low >= cutoff {
        return 1.0;
    }
    if high < cutoff {
        return 0.0;
    }
    let mut inside = 0;
    for j in 0..SUB {
        let (r, fy) = neighbour(j);
        for i in 0..SUB {
            let (c, fx) = neighbour(i);
            let top = alpha[r][c] * (1.0 - fx) + alpha[r][c + 1] * fx;
            let bottom = alpha[r + 1][c] * (1.0 - fx) + alpha[r + 1][c + 1] * fx;
            inside += u32::from(top * (1.0 - fy) + bottom * fy >= cutoff);
        }
    }
    inside as f32 / (SUB * SUB) as f32
}

/// Sub-sample `i` of a texel lies between neighbours `n` and `n + 1` (of −1, 0, 1) at fraction `f`.
fn neighbour(i: usize) -> (usize, f32) {
    let t = (i as f32 + 0.5) / SUB as f32 + 0.5;
    (t as usize, t.fract())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn texture(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Texture {
        let texels = (0..width * height).map(|i| texel(i % width, i / width)).collect();
        Texture { name: String::new(), width, height, texels, wrap: [Wrap::Repeat; 2] }
    }

    fn material(alpha_mode: AlphaMode) -> Material {
        Material { alpha_mode, ..Material::default() }
    }

    const WHOLE: [[Vec2; 3]; 2] =
        [[Vec2::ZERO, Vec2::X, Vec2::ONE], [Vec2::ZERO, Vec2::ONE, Vec2::Y]];

    fn mean_of_square(t: &ShadedTexture, depth: u32) -> [f32; 4] {
        let [a, b] = WHOLE.map(|uv| t.integrate(uv, depth));
        std::array::from_fn(|c| (a[c] + b[c]) / 2.0)
    }

    #[test]
    fn black_and_white_average_in_linear_light() {
        // sRGB averaging would give 0.216 (code 128); light gives one half.
        let checker = texture(64, 64, |x, y| {
            let v = if (x + y) % 2 == 0 { 255 } else { 0 };
            [v, v, v, 255]
        });
        let t = ShadedTexture::new(&checker, &Material::default());
        let m = mean_of_square(&t, 6);
        assert!((m[0] - 0.5).abs() < 1e-3 && m[3] == 1.0, "{m:?}");
    }

    #[test]
    fn transparent_texels_lend_no_colour() {
        let half = texture(32, 32, |x, _| if x < 16 { [255, 0, 0, 255] } else { [0, 255, 0, 0] });
        let t = ShadedTexture::new(&half, &material(AlphaMode::Blend));
        let m = mean_of_square(&t, 8);
        assert!((m[0] - 0.5).abs() < 5e-3 && m[1] < 1e-6 && (m[3] - 0.5).abs() < 5e-3, "{m:?}");
    }

    #[test]
    fn masked_disc_keeps_its_area_at_every_level() {
        // A soft-edged disc of radius 0.3: the cutoff 0.5 passes an area of π·0.09.
        let disc = texture(128, 128, |x, y| {
            let d = Vec2::new(x as f32 + 0.5, y as f32 + 0.5) / 128.0 - 0.5;
            let a = (0.5 + (0.3 - d.length()) * 10.0).clamp(0.0, 1.0);
            [0, 0, 0, (a * 255.0).round() as u8]
        });
        let t = ShadedTexture::new(&disc, &material(AlphaMode::Mask { cutoff: 0.5 }));
        for level in &t.levels {
            let sum: f64 = level.texels.iter().map(|t| f64::from(t[3])).sum();
            let mean = sum / f64::from(ONE) / level.texels.len() as f64;
            assert!((mean - std::f64::consts::PI * 0.09).abs() < 1e-3, "{mean} at {}", level.width);
        }
    }

    #[test]
    fn one_by_one_and_odd_sizes() {
        let t = ShadedTexture::new(&texture(1, 1, |_, _| [255, 128, 0, 255]), &Material::default());
        assert_eq!(t.levels.len(), 1);
        assert!((mean_of_square(&t, 8)[1] - srgb8_to_linear(128)).abs() < 1e-4);
        let ramp = texture(7, 5, |x, _| [(x * 36) as u8, 0, 0, 255]);
        let t = ShadedTexture::new(&ramp, &Material::default());
        let mean: f32 = (0..7).map(|x| srgb8_to_linear((x * 36) as u8)).sum::<f32>() / 7.0;
        let top = t.levels.last().unwrap().texels[0][0];
        assert!((f32::from(top) / ONE - mean).abs() < 1e-4);
    }

    #[test]
    fn hostile_coordinates_stay_in_the_image() {
        let t = ShadedTexture::new(&texture(3, 3, |_, _| [9, 9, 9, 255]), &Material::default());
        for uv in [1e30, -1e30, f32::NAN, f32::INFINITY] {
            let _ = t.integrate([Vec2::splat(uv), Vec2::ZERO, Vec2::ONE], 8);
        }
    }

    proptest! {
        /// The fast integral against 4,096 samples of the finest level.
        #[test]
        fn integral_agrees_with_brute_force(
            corners in prop::array::uniform6(-1.5f32..1.5),
            cutoff in 0.2f32..0.8,
        ) {
            let blobs = texture(64, 64, |x, y| {
                let wave = ((x as f32 * 0.35).sin() * (y as f32 * 0.27).cos() + 1.0) * 127.0;
                [(x * 4) as u8, (y * 4) as u8, 100, wave as u8]
            });
            let t = ShadedTexture::new(&blobs, &material(AlphaMode::Mask { cutoff }));
            let [a, b, c, d, e, f] = corners;
            let uv = [Vec2::new(a, b), Vec2::new(c, d), Vec2::new(e, f)];
            let n = 64;
            let mut exact = [0.0f32; 4];
            for i in 0..n {
                for j in 0..n {
                    // The square's samples folded onto the triangle: uniform over it.
                    let (s, r) = ((i as f32 + 0.5) / n as f32, (j as f32 + 0.25) / n as f32);
                    let (s, r) = if s + r > 1.0 { (1.0 - s, 1.0 - r) } else { (s, r) };
                    let sample = t.sample(uv[0] + (uv[1] - uv[0]) * s + (uv[2] - uv[0]) * r);
                    for c in 0..4 {
                        exact[c] += sample[c] / (n * n) as f32;
                    }
                }
            }
            let got = t.integrate(uv, 8);
            for c in 0..4 {
                prop_assert!((got[c] - exact[c]).abs() < 0.05, "{got:?} {exact:?}");
            }
        }
    }
}
