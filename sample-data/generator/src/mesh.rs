//! Stems become tubes, twigs get leaf cards.

use crate::skeleton::Stem;
use crate::species::Parameters;
use forest_soup::Mesh;
use glam::{Quat, Vec2, Vec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;

/// Bark repeats once in this many metres along a stem.
const BARK_REPEAT: f32 = 0.8;

/// All stems as tubes.
pub(crate) fn wood(p: &Parameters, stems: &[Stem]) -> Mesh {
    let mut mesh = Mesh { name: "wood".into(), material: 0, ..Mesh::default() };
    for stem in stems {
        tube(&mut mesh, stem, p.levels[stem.level].sides);
    }
    mesh
}

fn tube(mesh: &mut Mesh, stem: &Stem, sides: u32) {
    let rings = stem.line.len() as u32;
    let base = mesh.positions.len() as u32;
    let mut across = stem.at(0.0).1.any_orthonormal_vector();
    for i in 0..rings {
        let t = i as f32 / (rings - 1) as f32;
        let (_, along) = stem.at(t);
        across = (across - along * across.dot(along)).normalize_or(along.any_orthonormal_vector());
        let other = along.cross(across);
        // The seam's vertices are doubled, for the texture to close.
        for k in 0..=sides {
            let angle = k as f32 / sides as f32 * std::f32::consts::TAU;
            let normal = across * angle.cos() + other * angle.sin();
            mesh.positions.push(stem.line[i as usize] + normal * stem.radius_at(t));
            mesh.normals.push(normal);
            mesh.uvs.push(Vec2::new(k as f32 / sides as f32, t * stem.length / BARK_REPEAT));
        }
    }
    for i in 0..rings - 1 {
        for k in 0..sides {
            let at = |i: u32, k: u32| base + i * (sides + 1) + k;
            let (a, b, c, d) = (at(i, k), at(i, k + 1), at(i + 1, k + 1), at(i + 1, k));
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
}

/// `cards` leaf cards, spread evenly over the twigs (the stems of the last level).
pub(crate) fn leaves(p: &Parameters, stems: &[Stem], seed: u64, cards: u64) -> Mesh {
    let mut rng = Pcg32::seed_from_u64(seed ^ 0x1eaf);
    let mut mesh = Mesh { name: "leaves".into(), material: 1, ..Mesh::default() };
    let last = p.levels.len() - 1;
    let twigs: Vec<&Stem> = stems.iter().filter(|s| s.level == last).collect();
    let size = p.leaf_size * (p.leaf_cards / cards.max(1) as f32).sqrt();
    for card in 0..cards {
        let share = |n: u64| n * twigs.len() as u64 / cards.max(1);
        let twig = twigs[share(card) as usize];
        let t = rng.random_range(0.15f32..1.0);
        let (at, along) = twig.at(t);
        let out = Quat::from_axis_angle(along, rng.random_range(0.0..std::f32::consts::TAU))
            * along.any_orthonormal_vector();
        let tilt = if p.needle { 0.45 } else { 0.9 };
        let up = (along + out * tilt + Vec3::Y * 0.15).normalize();
        let spin = Quat::from_axis_angle(up, rng.random_range(0.0..std::f32::consts::TAU));
        let side = spin * up.any_orthonormal_vector();
        let length = size * rng.random_range(0.8..1.2);
        push_card(&mut mesh, at, up * length, side * (length * p.leaf_aspect * 0.5));
    }
    mesh
}

/// A quad from its base, its length and half its width; the texture's base is at v = 1.
fn push_card(mesh: &mut Mesh, base: Vec3, up: Vec3, half: Vec3) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend([base - half, base + half, base + half + up, base - half + up]);
    mesh.normals.extend([half.cross(up).normalize(); 4]);
    mesh.uvs.extend([Vec2::Y, Vec2::ONE, Vec2::X, Vec2::ZERO]);
    mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
}
