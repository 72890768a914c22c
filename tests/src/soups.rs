//! Small soups of known shape.

use forest_soup::{AlphaMode, Material, Texture, TriangleSoup, Wrap};
use glam::{Vec2, Vec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;
use std::sync::Arc;

/// An opaque, white, untextured soup of these triangles.
pub fn of_triangles(triangles: &[[Vec3; 3]]) -> TriangleSoup {
    let n = triangles.len() as u32;
    TriangleSoup {
        positions: triangles.as_flattened().to_vec(),
        triangles: (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        triangle_materials: vec![0; n as usize],
        materials: vec![Material::default()],
        ..TriangleSoup::default()
    }
}

/// `n` leaves of edge `size` at random places in the unit ball.
pub fn leaves(n: usize, size: f32, seed: u64) -> TriangleSoup {
    let mut rng = Pcg32::seed_from_u64(seed);
    let mut triangles = Vec::with_capacity(n);
    while triangles.len() < n {
        let mut v = |r: f32| Vec3::from_array(std::array::from_fn(|_| rng.random_range(-r..r)));
        let c = v(1.0);
        if c.length() < 1.0 {
            triangles.push([c, c + v(size), c + v(size)]);
        }
    }
    of_triangles(&triangles)
}

/// Gives every triangle the lower left half of a texture.
pub fn textured(mut soup: TriangleSoup, texture: Texture, alpha_mode: AlphaMode) -> TriangleSoup {
    soup.uvs = [Vec2::Y, Vec2::ONE, Vec2::ZERO].repeat(soup.triangles.len());
    soup.textures = vec![Arc::new(texture)];
    soup.materials =
        vec![Material { texture: Some(0), alpha_mode, double_sided: true, ..Material::default() }];
    soup
}

/// A square texture.
pub fn texture(side: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> Texture {
    let texels = (0..side * side).map(|i| texel(i % side, i / side)).collect();
    Texture { name: "made".into(), width: side, height: side, texels, wrap: [Wrap::Repeat; 2] }
}
