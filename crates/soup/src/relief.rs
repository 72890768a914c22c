//! Bumps of a surface: normal textures (glTF 2.0, section 3.9.3) and the frames they are told in.

use crate::{ShadedTexture, Texture};
use glam::{Vec2, Vec3};

/// The normal texture of a material: +x along growing u, +y up its picture (against v), +z out of the
/// surface; 8 bits a component, 0 … 255 for −1 … 1, linear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relief {
    /// Index into the textures of the model.
    pub texture: u32,
    /// Multiplies x and y; within ±[`Relief::MOST_SCALE`].
    pub scale: f32,
}

impl Relief {
    /// Largest scale: beyond it single precision would not hold lengths.
    pub const MOST_SCALE: f32 = 1e4;

    /// Whether it may be drawn with a model of so many textures.
    pub fn is_valid(&self, textures: usize) -> bool {
        (self.texture as usize) < textures && self.scale.abs() <= Self::MOST_SCALE
    }
}

/// A normal texture, ready to be sampled.
#[derive(Clone, Debug)]
pub struct NormalMap {
    texture: ShadedTexture,
    scale: f32,
}

impl NormalMap {
    /// Prepares `texture`.
    pub fn new(texture: &Texture, scale: f32) -> Self {
        Self { texture: ShadedTexture::data(texture), scale }
    }

    /// The unit normal at `uv` in the surface's own frame, from the level whose texels are nearest to `texels`
    /// of the finest in area.
    pub fn sample(&self, uv: Vec2, texels: f32) -> Vec3 {
        let [x, y, z, _] = self.texture.sample_area(uv, texels).map(|v| 2.0 * v - 1.0);
        Vec3::new(x * self.scale, y * self.scale, z).try_normalize().unwrap_or(Vec3::Z)
    }

    /// Texels of the finest level.
    pub fn texels(&self) -> f32 {
        self.texture.texels()
    }
}

/// Which way a triangle's texture coordinates grow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tangents {
    /// Of a step along u.
    pub along_u: Vec3,
    /// Of a step along v.
    pub along_v: Vec3,
}

impl Tangents {
    /// Of a triangle in space and in its texture; `None` where its texture has no area.
    ///
    /// These are constant on a triangle, and the tangents that a file may hold are not read: between
    /// triangles the normal is what turns, and the frame with it. MikkTSpace, which glTF names, takes the mean
    /// of the frames at a corner.
    pub fn new([a, b, c]: [Vec3; 3], uvs: [Vec2; 3]) -> Option<Self> {
        let [p, q] = [b - a, c - a];
        let [s, t] = [uvs[1] - uvs[0], uvs[2] - uvs[0]];
        let area = s.perp_dot(t);
        // Small texture areas are no reason: only directions count.
        (area != 0.0 && area.is_finite()).then(|| Self {
            along_u: (p * t.y - q * s.y) * area.signum(),
            along_v: (q * s.x - p * t.x) * area.signum(),
        })
    }

    /// The unit normal `normal`, which faces the side that is seen, as `bump` ([`NormalMap::sample`]) turns it.
    /// `front` says whether that side is the front, for which bumps are told: from behind, hills are hollows.
    pub fn turn(&self, normal: Vec3, front: bool, bump: Vec3) -> Vec3 {
        let u = self.along_u - normal * normal.dot(self.along_u);
        let Some(u) = u.try_normalize() else { return normal };
        let across = normal.cross(u);
        // Up the picture is against v.
        let up = if across.dot(self.along_v) > 0.0 { -across } else { across };
        let side = if front { 1.0 } else { -1.0 };
        ((u * bump.x + up * bump.y) * side + normal * bump.z).normalize_or(normal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Wrap;

    /// A square in z = 0 whose picture is seen upright from +z: u along x, v against y.
    const SQUARE: ([Vec3; 3], [Vec2; 3]) =
        ([Vec3::ZERO, Vec3::X, Vec3::Y], [Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::ZERO]);

    #[test]
    fn an_upright_picture_turns_normals_as_it_says() {
        let frame = Tangents::new(SQUARE.0, SQUARE.1).unwrap();
        let bump = Vec3::new(0.6, 0.0, 0.8);
        assert!(frame.turn(Vec3::Z, true, bump).distance(bump) < 1e-6);
        let bump = Vec3::new(0.0, 0.6, 0.8);
        assert!(frame.turn(Vec3::Z, true, bump).distance(bump) < 1e-6);
        // From behind the same slope leans the other way about.
        let behind = frame.turn(-Vec3::Z, false, bump);
        assert!(behind.distance(-bump) < 1e-6, "{behind}");
    }

    #[test]
    fn mirrored_pictures_mirror_their_bumps() {
        let bump = Vec3::new(0.48, 0.36, 0.8);
        let mirrored = SQUARE.1.map(|uv| Vec2::new(-uv.x, uv.y));
        let frame = Tangents::new(SQUARE.0, mirrored).unwrap();
        let want = Vec3::new(-0.48, 0.36, 0.8);
        assert!(frame.turn(Vec3::Z, true, bump).distance(want) < 1e-6);
        // Coordinates far apart or near each other say the same directions.
        for scale in [1e-9, 1e9] {
            let far = SQUARE.1.map(|uv| uv * scale);
            let frame = Tangents::new(SQUARE.0, far).unwrap();
            assert!(frame.turn(Vec3::Z, true, bump).distance(bump) < 1e-6);
        }
        assert_eq!(Tangents::new(SQUARE.0, [Vec2::ONE; 3]), None);
    }

    #[test]
    fn a_flat_texture_turns_nothing_and_half_a_scale_halves_slopes() {
        let texture = |texel| Texture {
            name: String::new(),
            width: 1,
            height: 1,
            texels: vec![texel],
            wrap: [Wrap::Repeat; 2],
        };
        let flat = NormalMap::new(&texture([128, 128, 255, 255]), 1.0).sample(Vec2::ZERO, 1.0);
        // 128 is not quite 0: half a step.
        assert!(flat.distance(Vec3::Z) < 0.006, "{flat}");
        let steep = NormalMap::new(&texture([255, 128, 255, 255]), 0.5).sample(Vec2::ZERO, 1.0);
        assert!((steep.x / steep.z - 0.5).abs() < 1e-5, "{steep}");
    }
}
