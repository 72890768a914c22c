//! The stems of a tree: centre lines and radii.

use crate::species::Parameters;
use glam::{Quat, Vec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;

/// A curved stem.
pub(crate) struct Stem {
    pub(crate) level: usize,
    /// Points of the centre line, base first.
    pub(crate) line: Vec<Vec3>,
    /// Radius at the base; it tapers to a tenth.
    pub(crate) radius: f32,
    pub(crate) length: f32,
}

impl Stem {
    /// The point and direction at share `t` of the length.
    pub(crate) fn at(&self, t: f32) -> (Vec3, Vec3) {
        let last = self.line.len() - 2;
        let x = t.clamp(0.0, 1.0) * (last + 1) as f32;
        let i = (x as usize).min(last);
        let (a, b) = (self.line[i], self.line[i + 1]);
        (a.lerp(b, x - i as f32), (b - a).normalize())
    }

    pub(crate) fn radius_at(&self, t: f32) -> f32 {
        self.radius * (1.0 - 0.9 * t)
    }
}

/// Grows all stems, parents before children.
pub(crate) fn grow(p: &Parameters, seed: u64) -> Vec<Stem> {
    let mut rng = Pcg32::seed_from_u64(seed);
    let mut stems: Vec<Stem> = Vec::new();
    let mut parents = 0..0;
    for (level, l) in p.levels.iter().enumerate() {
        let start = stems.len();
        let parent_count = if level == 0 { 1 } else { parents.len() };
        for parent in 0..parent_count {
            let mut turn = rng.random_range(0.0f32..360.0);
            for k in 0..l.branches {
                let t = l.bare + (1.0 - l.bare) * (k as f32 + 0.5) / l.branches as f32;
                turn += l.rotate + rng.random_range(-15.0f32..15.0);
                let down = l.down_angle + vary(&mut rng, l.down_angle_v);
                let grown = if level == 0 {
                    let length = p.height * (l.length + vary(&mut rng, l.length_v));
                    let radius = length * p.ratio;
                    let direction = turned(Vec3::Y, down, turn);
                    (Vec3::ZERO, direction, length, radius)
                } else {
                    let stem: &Stem = &stems[parents.start + parent];
                    let (base, along) = stem.at(t);
                    let share = if level == 1 {
                        p.shape.ratio((1.0 - t) / (1.0 - l.bare))
                    } else {
                        1.0 - 0.6 * t
                    };
                    let length = stem.length * share * (l.length + vary(&mut rng, l.length_v));
                    let radius = stem.radius * (length / stem.length).powf(p.ratio_power);
                    let radius = radius.min(0.9 * stem.radius_at(t));
                    (base, turned(along, down, turn), length, radius)
                };
                let bend = l.curve + vary(&mut rng, l.curve_v);
                stems.push(curved(&mut rng, level, grown, bend, l.segments));
            }
        }
        parents = start..stems.len();
    }
    stems
}

/// A stem from base, direction, length and radius; `bend` turns it upwards along its length.
fn curved(
    rng: &mut Pcg32,
    level: usize,
    (base, direction, length, radius): (Vec3, Vec3, f32, f32),
    bend: f32,
    segments: u32,
) -> Stem {
    let mut line = vec![base];
    let (mut at, mut along) = (base, direction);
    for _ in 0..segments {
        let side = along.cross(Vec3::Y).normalize_or(Vec3::X);
        let turn = (bend + rng.random_range(-12.0f32..12.0)) / segments as f32;
        along = Quat::from_axis_angle(side, turn.to_radians()) * along;
        along = Quat::from_axis_angle(Vec3::Y, rng.random_range(-6.0f32..6.0).to_radians()) * along;
        at += along * (length / segments as f32);
        line.push(at);
    }
    Stem { level, line, radius, length }
}

/// `along`, tilted by `down` degrees and turned by `turn` degrees about itself.
fn turned(along: Vec3, down: f32, turn: f32) -> Vec3 {
    let side = along.any_orthonormal_vector();
    let tilted = Quat::from_axis_angle(side, down.to_radians()) * along;
    Quat::from_axis_angle(along, turn.to_radians()) * tilted
}

fn vary(rng: &mut Pcg32, range: f32) -> f32 {
    rng.random_range(-1.0f32..1.0) * range
}
