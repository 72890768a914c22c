//! Coverage alone, at every resolution: what many small pictures ask a texture for.

use crate::{Material, ShadedTexture, Texture, Wrap};
use glam::Vec2;

/// The coverage of a texture under a material's alpha rule, 8 bits a texel, with every coarser
/// level: the share of a texel that an alpha test at infinite resolution would show.
#[derive(Clone, Debug)]
pub struct CoverageMap {
    levels: Vec<Level>,
    wrap: [Wrap; 2],
}

#[derive(Clone, Debug)]
pub(crate) struct Level {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) texels: Vec<u8>,
}

impl CoverageMap {
    /// The coverage of `texture` under `material`.
    pub fn new(texture: &Texture, material: &Material) -> Self {
        let levels = ShadedTexture::new(texture, material).coverage_levels();
        Self { levels, wrap: texture.wrap }
    }

    /// The coarsest level whose texels are not larger than `texels` of the finest (an area).
    #[inline]
    pub fn level(&self, texels: f32) -> usize {
        // Half the binary exponent, rounded down.
        let exponent = ((texels.to_bits() >> 23) as i32 - 127) >> 1;
        (exponent.max(0) as usize).min(self.levels.len() - 1)
    }

    /// Coverage · 255 of the texel of `level` at texture coordinates `uv`.
    #[inline]
    pub fn nearest(&self, level: usize, uv: Vec2) -> u8 {
        let l = &self.levels[level];
        let texel = |t: f32, wrap: Wrap, n: u32| wrap.index((t * n as f32).floor() as i64, n);
        let (x, y) = (texel(uv.x, self.wrap[0], l.width), texel(uv.y, self.wrap[1], l.height));
        l.texels[y * l.width as usize + x]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::AlphaMode;

    #[test]
    fn levels_keep_the_share_that_passes_the_test() {
        // Every fourth column passes.
        let texel = |i: u32| [0, 0, 0, if i % 4 == 1 { 255 } else { 0 }];
        let texture = Texture {
            name: String::new(),
            width: 16,
            height: 16,
            texels: (0..256).map(texel).collect(),
            wrap: [Wrap::Repeat, Wrap::Clamp],
        };
        let material =
            Material { alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, ..Material::default() };
        let map = CoverageMap::new(&texture, &material);
        assert_eq!(
            [0.2, 1.0, 3.9, 4.0, 15.9, 16.0, 1e9].map(|t| map.level(t)),
            [0, 0, 0, 1, 1, 2, 4]
        );
        assert_eq!(map.nearest(0, Vec2::new(1.5 / 16.0, 0.3)), 255);
        assert_eq!(map.nearest(0, Vec2::new(1.0 + 1.5 / 16.0, 7.0)), 255);
        assert_eq!(map.nearest(0, Vec2::new(-14.5 / 16.0, 0.3)), 255);
        assert_eq!(map.nearest(0, Vec2::new(2.5 / 16.0, 0.3)), 0);
        // A bilinear alpha of at least ½ is one texel wide: a quarter everywhere.
        assert_eq!(map.nearest(2, Vec2::splat(0.4)), 64);
        assert_eq!(map.nearest(4, Vec2::splat(0.9)), 64);
    }
}
