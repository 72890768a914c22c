//! Procedural bark and leaf cards.

use crate::species::Parameters;
use forest_soup::{Texture, Wrap, linear_to_srgb8};
use glam::Vec2;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;

const SIZE: u32 = 256;

/// Bark that repeats both ways: furrows of a few sines of whole periods.
pub(crate) fn bark(p: &Parameters, seed: u64) -> Texture {
    let mut rng = Pcg32::seed_from_u64(seed ^ 0xba2c);
    let waves: Vec<[f32; 4]> = (0..12)
        .map(|k| {
            let across = rng.random_range(2i32..10) as f32;
            let along = rng.random_range(-3i32..4) as f32;
            [
                across,
                along,
                rng.random_range(0.0..std::f32::consts::TAU),
                1.0 / (1.0 + k as f32 * 0.3),
            ]
        })
        .collect();
    image("bark", |uv| {
        let phase = |w: &[f32; 4]| std::f32::consts::TAU * (w[0] * uv.x + w[1] * uv.y) + w[2];
        let height: f32 = waves.iter().map(|w| phase(w).sin() * w[3]).sum();
        let shade = (0.8 + 0.16 * height).clamp(0.25, 1.6);
        let [r, g, b] = p.bark_color.map(|c| linear_to_srgb8(c * shade));
        [r, g, b, 255]
    })
}

/// One leaf of a card, in the card's unit square (base at v = 1).
struct Leaf {
    base: Vec2,
    direction: Vec2,
    length: f32,
    width: f32,
    shade: f32,
}

/// A card with a stalk and leaves, transparent elsewhere.
pub(crate) fn leaves(p: &Parameters, seed: u64) -> Texture {
    let mut rng = Pcg32::seed_from_u64(seed ^ 0x1eaf_c0de);
    let n = p.leaves_on_card;
    let shape: Vec<Leaf> = (0..n)
        .map(|k| {
            let t = (k as f32 + 0.5) / n as f32;
            let single = n == 1;
            let side = if k % 2 == 0 { 1.0 } else { -1.0 };
            let lean = if single { 0.0 } else { side * (if p.needle { 0.8 } else { 0.9 }) };
            let length = match (single, p.needle) {
                (true, _) => 0.96,
                (_, true) => 0.42 * (1.0 - 0.4 * t),
                (_, false) => 0.40,
            };
            Leaf {
                base: Vec2::new(0.5, if single { 0.98 } else { 0.97 - 0.72 * t }),
                direction: Vec2::new(lean, -1.0).normalize(),
                length: length * rng.random_range(0.9..1.0),
                width: if p.needle { 0.16 } else { 0.42 },
                shade: rng.random_range(0.75..1.25),
            }
        })
        .collect();
    image("leaves", |uv| {
        let stalk = (uv.x - 0.5).abs() < 0.012 && uv.y > 0.2;
        let hit = shape.iter().rev().find_map(|leaf| leaf.shade_at(uv));
        let (shade, alpha) = match hit {
            Some(shade) => (shade, 255),
            None => (0.6, if stalk { 255 } else { 0 }),
        };
        let [r, g, b] = p.leaf_color.map(|c| linear_to_srgb8(c * shade));
        [r, g, b, alpha]
    })
}

impl Leaf {
    /// Brightness of the leaf at `uv`, or `None` beside it.
    fn shade_at(&self, uv: Vec2) -> Option<f32> {
        let d = uv - self.base;
        let along = d.dot(self.direction) / self.length;
        let across = d.perp_dot(self.direction).abs() / self.length;
        let half =
            0.5 * self.width * (std::f32::consts::PI * along.clamp(0.0, 1.0)).sin().powf(0.8);
        let inside = (0.0..=1.0).contains(&along) && across < half.max(0.0);
        // A lighter midrib and side veins.
        let vein = if across < 0.012 || ((along * 9.0 + across * 12.0).fract() < 0.12) {
            1.2
        } else {
            1.0
        };
        inside.then_some(self.shade * vein * (0.85 + 0.3 * along))
    }
}

fn image(name: &str, texel: impl Fn(Vec2) -> [u8; 4]) -> Texture {
    let at = |i: u32| Vec2::new((i % SIZE) as f32 + 0.5, (i / SIZE) as f32 + 0.5) / SIZE as f32;
    let texels = (0..SIZE * SIZE).map(|i| texel(at(i))).collect();
    Texture { name: name.into(), width: SIZE, height: SIZE, texels, wrap: [Wrap::Repeat; 2] }
}
