//! What the canvas draws: splats and textured triangles, in sample coordinates.

use forest_points::covers;
use forest_points::spheroid::Footprint;
use forest_soup::{AlphaMode, Material, ShadedTexture, Texture};
use glam::{DVec2, Vec2};

/// Something to draw. Coordinates count samples from the picture's top left corner.
#[derive(Clone, Debug)]
pub(crate) enum Primitive<'a> {
    /// A point.
    Splat(Splat),
    /// A triangle of the source.
    Triangle(Box<Triangle<'a>>),
}

/// A point as it is drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Splat {
    pub(crate) id: u32,
    pub(crate) footprint: Footprint,
    pub(crate) depth: f64,
    pub(crate) opacity: u8,
    pub(crate) rgb: [f32; 3],
}

/// A projected triangle.
#[derive(Clone, Debug)]
pub(crate) struct Triangle<'a> {
    pub(crate) id: u32,
    pub(crate) corners: [DVec2; 3],
    pub(crate) depths: [f64; 3],
    /// 1 for parallel projection, else 1/depth: attributes are linear in it.
    pub(crate) inverse_w: [f64; 3],
    pub(crate) uvs: [Vec2; 3],
    /// Vertex colours, linear.
    pub(crate) colors: [[f32; 4]; 3],
    pub(crate) light: f32,
    pub(crate) surface: &'a Surface,
}

impl Triangle<'_> {
    /// Depth and linear RGB at `p` of sample (x, y), or `None` where nothing covers it.
    pub(crate) fn shade(&self, p: DVec2, x: u32, y: u32) -> Option<(f64, [f32; 3])> {
        let [a, b, c] = self.corners;
        let area = (b - a).perp_dot(c - a);
        let inside = [(b, c), (c, a), (a, b)].map(|(u, v)| (v - u).perp_dot(p - u) / area);
        // Shared edges belong to both triangles: no cracks, and the nearer one wins.
        if !inside.iter().all(|&w| w >= 0.0) {
            return None;
        }
        let weights: [f64; 3] = std::array::from_fn(|k| inside[k] * self.inverse_w[k]);
        let sum: f64 = weights.iter().sum();
        let w = weights.map(|v| v / sum);
        let mix = |v: [f64; 3]| v[0] * w[0] + v[1] * w[1] + v[2] * w[2];
        let f = w.map(|v| v as f32);
        let uv = self.uvs[0] * f[0] + self.uvs[1] * f[1] + self.uvs[2] * f[2];
        let tint: [f32; 4] = std::array::from_fn(|k| {
            self.colors[0][k] * f[0] + self.colors[1][k] * f[1] + self.colors[2][k] * f[2]
        });
        let rgb = self.surface.at(uv, tint, |opacity| covers(self.id, x, y, opacity))?;
        Some((mix(self.depths), rgb.map(|v| v * self.light)))
    }
}

/// A material with its texture, ready to be sampled.
#[derive(Clone, Debug)]
pub(crate) struct Surface {
    material: Material,
    texture: Option<ShadedTexture>,
}

impl Surface {
    pub(crate) fn new(material: &Material, textures: &[std::sync::Arc<Texture>]) -> Self {
        // Sampled alpha goes through the material's rule at each sample: keep it raw.
        let raw = match material.alpha_mode {
            AlphaMode::Opaque => AlphaMode::Opaque,
            AlphaMode::Mask { .. } | AlphaMode::Blend => AlphaMode::Blend,
        };
        let whole =
            Material { alpha_mode: raw, base_color: with_alpha(material, 1.0), ..material.clone() };
        let texture = material.texture.map(|t| ShadedTexture::new(&textures[t as usize], &whole));
        Self { material: material.clone(), texture }
    }

    pub(crate) fn is_unlit(&self) -> bool {
        self.material.unlit
    }

    /// Linear RGB, or `None` where the surface does not cover the sample.
    fn at(&self, uv: Vec2, tint: [f32; 4], hash: impl Fn(u8) -> bool) -> Option<[f32; 3]> {
        let [r, g, b, _] = self.material.base_color;
        let (rgb, alpha) = match &self.texture {
            Some(texture) => {
                let [r, g, b, a] = texture.sample(uv);
                if a <= 0.0 {
                    return None;
                }
                ([r / a, g / a, b / a], a)
            }
            None => ([r, g, b], 1.0),
        };
        let coverage = self.material.coverage(alpha, tint[3]);
        let covered = hash((coverage * 255.0).round() as u8);
        covered.then(|| [0, 1, 2].map(|k| rgb[k] * tint[k]))
    }
}

fn with_alpha(material: &Material, alpha: f32) -> [f32; 4] {
    let [r, g, b, _] = material.base_color;
    [r, g, b, alpha]
}
