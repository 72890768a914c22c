//! What a triangle's surface looks like: base colour, coverage, bumps and what shines through.

use crate::Relief;

/// How the alpha of a material becomes coverage (glTF 2.0, section 3.9.5).
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum AlphaMode {
    /// Alpha is ignored; the surface covers everything.
    #[default]
    Opaque,
    /// Covered where alpha ≥ the cutoff.
    Mask {
        /// The cutoff, usually 0.5.
        cutoff: f32,
    },
    /// Alpha is coverage.
    Blend,
}

/// A surface: a linear base colour, an optional texture that multiplies it, and the alpha rule.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in the source file; may be empty.
    pub name: String,
    /// Linear RGB and alpha, each in `0..=1`.
    pub base_color: [f32; 4],
    /// Index into the textures of the model.
    pub texture: Option<u32>,
    /// Its normal texture, which has the coordinates of the other.
    pub relief: Option<Relief>,
    /// How alpha becomes coverage.
    pub alpha_mode: AlphaMode,
    /// Both faces are seen. Bakers treat every surface as two-sided (a leaf has no inside);
    /// the flag is kept for exporters.
    pub double_sided: bool,
    /// The colour is emitted as it is, without lighting.
    pub unlit: bool,
    /// Share of a light's translucency that this surface has, `0..=1`: light on its far side shines through
    /// as much of it as that.
    pub translucency: f32,
    /// A surface stands for many leaves that face all ways: it is lit by their mean, not by its normal.
    pub scattered: bool,
}

impl Default for Material {
    /// White, opaque, untextured.
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: [1.0; 4],
            texture: None,
            relief: None,
            alpha_mode: AlphaMode::Opaque,
            double_sided: false,
            unlit: false,
            translucency: 1.0,
            scattered: false,
        }
    }
}

impl Material {
    /// The coverage of a surface point with texture alpha `texture_alpha` and vertex alpha
    /// `vertex_alpha`, in `0..=1`.
    pub fn coverage(&self, texture_alpha: f32, vertex_alpha: f32) -> f32 {
        let alpha = self.base_color[3] * texture_alpha * vertex_alpha;
        match self.alpha_mode {
            AlphaMode::Opaque => 1.0,
            AlphaMode::Mask { cutoff } => f32::from(alpha >= cutoff),
            AlphaMode::Blend => alpha.clamp(0.0, 1.0),
        }
    }
}
