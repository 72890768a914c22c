//! Materials, ready to be sampled.

use forest_soup::{AlphaMode, Material, NormalMap, Relief, ShadedTexture, Texture};
use glam::Vec2;
use std::sync::Arc;

/// The materials of a soup or a pack with their textures in linear light.
#[derive(Clone, Debug, Default)]
pub struct Surfaces(Vec<Surface>);

impl Surfaces {
    /// Prepares `materials`, whose texture indices must lie in `textures`.
    pub fn new(materials: &[Material], textures: &[Arc<Texture>]) -> Self {
        Self(materials.iter().map(|m| Surface::new(m, textures)).collect())
    }

    /// Surface of material `index`.
    pub(crate) fn get(&self, index: u16) -> Option<&Surface> {
        self.0.get(usize::from(index))
    }
}

/// A material with its texture at full resolution: a far card must have the right *mean* alpha,
/// which a filtered texture behind an alpha test has not.
#[derive(Clone, Debug)]
pub(crate) struct Surface {
    material: Material,
    texture: Option<ShadedTexture>,
    relief: Option<NormalMap>,
    /// Some of it may be seen through.
    pub(crate) translucent: bool,
}

impl Surface {
    fn new(material: &Material, textures: &[Arc<Texture>]) -> Self {
        // Sampled alpha goes through the material's rule at each sample: keep it raw.
        let alpha_mode = match material.alpha_mode {
            AlphaMode::Opaque => AlphaMode::Opaque,
            AlphaMode::Mask { .. } | AlphaMode::Blend => AlphaMode::Blend,
        };
        let [r, g, b, _] = material.base_color;
        let raw = Material { alpha_mode, base_color: [r, g, b, 1.0], ..material.clone() };
        let texture = material.texture.map(|t| ShadedTexture::new(&textures[t as usize], &raw));
        let map = |r: Relief| NormalMap::new(&textures[r.texture as usize], r.scale);
        let relief = material.relief.map(map);
        let translucent = material.alpha_mode != AlphaMode::Opaque;
        Self { material: material.clone(), texture, relief, translucent }
    }

    pub(crate) fn is_scattered(&self) -> bool {
        self.material.scattered
    }

    /// Share of a light's translucency.
    pub(crate) fn translucency(&self) -> f32 {
        self.material.translucency
    }

    pub(crate) fn is_unlit(&self) -> bool {
        self.material.unlit
    }

    /// Its normal texture.
    pub(crate) fn relief(&self) -> Option<&NormalMap> {
        self.relief.as_ref()
    }

    /// Coverage under vertex alpha `tint`: that of [`Surface::at`], at less cost.
    #[inline]
    pub(crate) fn coverage(&self, uv: Vec2, tint: f32) -> f32 {
        let alpha = self.texture.as_ref().map_or(1.0, |texture| texture.sample_alpha(uv));
        self.material.coverage(alpha, tint)
    }

    /// Linear RGB under vertex colour `tint`, and coverage. The colour of what covers nothing is
    /// black.
    pub(crate) fn at(&self, uv: Vec2, tint: [f32; 4]) -> ([f32; 3], f32) {
        let sample = self.texture.as_ref().map(|t| t.sample(uv));
        let coverage = self.material.coverage(sample.map_or(1.0, |s| s[3]), tint[3]);
        (self.tinted(sample, tint), coverage)
    }

    /// Linear RGB, not premultiplied, of `texels` texels (an area) about `uv`.
    pub(crate) fn color(&self, uv: Vec2, texels: f32, tint: [f32; 4]) -> [f32; 3] {
        self.tinted(self.texture.as_ref().map(|t| t.sample_area(uv, texels)), tint)
    }

    /// Texels of its texture, or of its normal texture if there is no other; 0 without both.
    pub(crate) fn texels(&self) -> f32 {
        let own = self.texture.as_ref().map(ShadedTexture::texels);
        own.or(self.relief.as_ref().map(NormalMap::texels)).unwrap_or(0.0)
    }

    /// Mean over a triangle of what it shows: linear RGB weighted by alpha, not premultiplied;
    /// from up to 2^`depth` samples.
    pub(crate) fn mean(&self, uvs: [Vec2; 3], tint: [f32; 4], depth: u32) -> [f32; 3] {
        self.tinted(self.texture.as_ref().map(|t| t.integrate(uvs, depth)), tint)
    }

    /// A premultiplied sample of the texture, if there is one, without its alpha and under a tint.
    fn tinted(&self, sample: Option<[f32; 4]>, tint: [f32; 4]) -> [f32; 3] {
        let rgb = match sample {
            Some([r, g, b, a]) => {
                let scale = if a > 0.0 { 1.0 / a } else { 0.0 };
                [r, g, b].map(|v| v * scale)
            }
            None => [0, 1, 2].map(|k| self.material.base_color[k]),
        };
        std::array::from_fn(|k| rgb[k] * tint[k])
    }
}
