//! Small soups of known shape.

use forest_soup::{AlphaMode, Material, Relief, Texture, TriangleSoup, Wrap};
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

/// A tree of three materials: a trunk ("bark") of six sides, unwelded, with four branches that do not touch
/// it, and "leaf" squares at their tips. Its height is 4; it stands at (0, 0, 0).
pub fn small_tree() -> TriangleSoup {
    let mut triangles = Vec::new();
    let mut tube = |from: Vec3, to: Vec3, radii: [f32; 2], rings: u32| {
        let along = (to - from).normalize();
        let x = along.any_orthonormal_vector();
        let y = along.cross(x);
        let corner = |ring: u32, side: u32| {
            let t = ring as f32 / rings as f32;
            let angle = side as f32 * std::f32::consts::TAU / 6.0;
            let radius = radii[0] + (radii[1] - radii[0]) * t;
            from.lerp(to, t) + (x * angle.cos() + y * angle.sin()) * radius
        };
        for (r, k) in (0..rings).flat_map(|r| (0..6).map(move |k| (r, k))) {
            let [a, b, c, d] =
                [corner(r, k), corner(r, k + 1), corner(r + 1, k), corner(r + 1, k + 1)];
            triangles.extend([[a, b, d], [a, d, c]]);
        }
    };
    tube(Vec3::ZERO, Vec3::Y * 4.0, [0.2, 0.04], 8);
    let tips = [0.0f32, 1.7, 3.1, 4.6].map(|yaw| {
        let out = Vec3::new(yaw.cos(), 0.6, yaw.sin());
        let base = Vec3::Y * (1.6 + 0.3 * yaw) + out * 0.25;
        tube(base, base + out, [0.06, 0.02], 4);
        base + out
    });
    let wood = triangles.len();
    for (i, tip) in tips.into_iter().chain([Vec3::Y * 4.0]).enumerate() {
        for k in 0..12 {
            let turn = 2.4 * (12 * i + k) as f32;
            let place = tip + Vec3::new(turn.cos(), 0.4 * (3.0 * turn).sin(), turn.sin()) * 0.35;
            let (a, b) = (
                Vec3::new(turn.sin(), 0.7, turn.cos()) * 0.15,
                Vec3::new(0.1, turn.cos(), 0.9) * 0.12,
            );
            let [p, q, r, s] = [place - a - b, place + a - b, place + a + b, place - a + b];
            triangles.extend([[p, q, r], [p, r, s]]);
        }
    }
    let mut soup = of_triangles(&triangles);
    let named =
        |name: &str, base_color| Material { name: name.into(), base_color, ..Material::default() };
    soup.materials =
        vec![named("bark", [0.2, 0.12, 0.08, 1.0]), named("leaf", [0.1, 0.4, 0.05, 1.0])];
    soup.triangle_materials[wood..].fill(1);
    soup
}

/// [`small_tree`] with bumps on its bark.
pub fn bumpy_tree() -> TriangleSoup {
    let tree = small_tree();
    let bumps = texture(4, |x, y| [96 + 20 * x as u8, 96 + 20 * y as u8, 240, 255]);
    let mut soup = textured(tree.clone(), bumps, AlphaMode::Opaque);
    soup.materials = tree.materials;
    soup.materials[0].relief = Some(Relief { texture: 0, scale: 0.8 });
    soup
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
