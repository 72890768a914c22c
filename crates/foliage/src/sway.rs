//! How a whole tree leans in the wind: what representations show that know nothing of branches.
//!
//! A height of h above its foot moves sideways by lean · h². Where the tree's branches are known, that is
//! the mean of what they do, by least squares; so a change of representation in the wind moves nothing
//! in the mean. The tree grows no longer than by a per cent: two thirds of the square of how far its top
//! moves, in heights, which is [`MOST_LEAN`] at most.

use crate::block::{FoliageBlock, Posed};
use crate::wind::Wind;
use glam::{Vec2, Vec3};

/// How a tree leans at a moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sway {
    /// Height of its foot in the world's y, about the origin that its maker says.
    pub foot: f32,
    /// Displacement along x and z for the square of a height: one over world units.
    pub lean: Vec2,
}

/// Displacement of the top of a tree of unknown branches in a wind of strength 1 that pushes by 1, in
/// heights.
pub const USUAL_LIMBER: f32 = 0.06;

/// Vertices that are asked how they move, at most.
const ASKED: usize = 2000;

/// No top moves farther, in heights.
pub const MOST_LEAN: f32 = 0.12;

impl Sway {
    /// That of a tree of this height whose foot is at height `foot`; `phase` in turns tells trees apart.
    pub fn new(limber: f32, foot: f32, height: f32, wind: &Wind, phase: f32) -> Self {
        let [along, across] = wind.push(phase);
        let direction = Vec2::new(wind.direction.x, wind.direction.z);
        let side = wind.direction.cross(Vec3::Y);
        let push = direction * along + Vec2::new(side.x, side.z) * across;
        let lean = (push * (wind.strength * limber)).clamp_length_max(MOST_LEAN);
        Self { foot, lean: lean / height.max(f32::MIN_POSITIVE) }
    }

    /// The mean of what vertices of the finest level do; the foot is about the block's origin.
    pub fn of(block: &FoliageBlock, posed: &Posed) -> Self {
        let [min, max] = block.header.bounds;
        let foot = min[1] as f32;
        let (mut sum, mut weight) = (Vec2::ZERO, 0.0);
        let all = block.vertices[0];
        for v in all.iter().step_by(all.len().div_ceil(ASKED).max(1)) {
            let p = Vec3::from(v.position);
            let square = (p.y - foot).max(0.0).powi(2);
            let moved = posed.place(block, v).0 - p;
            sum += Vec2::new(moved.x, moved.z) * square;
            weight += square * square;
        }
        let height = (max[1] - min[1]).max(f64::MIN_POSITIVE) as f32;
        let lean = (sum / f32::max(weight, f32::MIN_POSITIVE)) * height;
        Self { foot, lean: lean.clamp_length_max(MOST_LEAN) / height }
    }

    /// Displacement at height `y`, about the same origin.
    pub fn at(&self, y: f32) -> Vec3 {
        let square = (y - self.foot).max(0.0).powi(2);
        Vec3::new(self.lean.x * square, 0.0, self.lean.y * square)
    }

    /// What [`Sway::new`] needs of a tree whose branches are known: the mean over a while.
    pub fn limber(block: &FoliageBlock) -> f32 {
        const MOMENTS: u32 = 8;
        let [min, max] = block.header.bounds;
        let height = (max[1] - min[1]) as f32;
        let (mut sum, mut pushed) = (0.0, 0.0);
        for i in 0..MOMENTS {
            // Moments that share no period with the swings.
            let wind = Wind { strength: 1.0, time: 7.3 * i as f32, ..Wind::default() };
            let posed = Posed::new(block, &wind, 0.0, block.origin() + glam::DVec3::Z * 1e3);
            let lean = Self::of(block, &posed).lean;
            sum += lean.dot(Vec2::new(wind.direction.x, wind.direction.z)) * height;
            pushed += wind.push(0.0)[0];
        }
        (sum / pushed).clamp(0.0, MOST_LEAN)
    }
}
