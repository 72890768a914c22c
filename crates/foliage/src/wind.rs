//! Wind: how branches bend, and what hangs on them moves along.
//!
//! Candussi, Candussi, Höllerer 2005: the tip of every branch is displaced by the sum of a vector
//! along the wind and a smaller one across it, both with factors that change periodically; the rest
//! of the branch follows by its distance from the tip; leaves turn about the view axis by sines.
//! Here the displacement of the tip is made by *bending*: the direction of the branch turns about
//! one axis by an angle that grows evenly from base to tip, and the place of every point is the
//! integral of that direction. So no branch stretches, however strong the wind is. The middle line
//! is a parabola, for which the integral has a closed form.

use crate::branch::{Branch, Branches, OnBranch};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Quat, Vec3};

/// Branches below the third level move with the branch that they grow from.
pub const MOST_LEVELS: u32 = 3;

/// No branch: the parent of the trunk.
pub const NO_BRANCH: u32 = u32::MAX;

/// A branch as wind moves it: 64 bytes, as shaders read them. Lengths are in world units about the
/// pack's foliage origin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct BranchRecord {
    /// Where it leaves its parent.
    pub base: [f32; 3],
    /// The branch that it grows from, a smaller number; [`NO_BRANCH`] for the trunk.
    pub parent: u32,
    /// The middle line is base + linear·s + square·s², s from 0 at the base to 1 at the tip.
    pub linear: [f32; 3],
    /// Share of the parent's length at which it leaves it, `0..=1`.
    pub at: f32,
    /// See `linear`.
    pub square: [f32; 3],
    /// Length along the line.
    pub length: f32,
    /// Displacement of the tip in a wind of strength 1, in lengths; at most [`MOST_FLEXIBLE`].
    pub flexibility: f32,
    /// Of its swing, in turns, `0..1`.
    pub phase: f32,
    /// Of its swing, in those of the trunk.
    pub frequency: f32,
    /// 0 for the trunk, 1 and 2 for branches of branches.
    pub level: u32,
}

const _: () = assert!(size_of::<BranchRecord>() == 64);

/// Steps along a branch.
pub const ALONG_STEPS: f32 = 65535.0;

/// A place on a branch: 4 bytes, as shaders read them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
#[repr(C)]
pub struct Hung {
    /// The branch record.
    pub branch: u16,
    /// How far along that branch, 0 … [`ALONG_STEPS`] from base to tip.
    pub along: u16,
}

impl Hung {
    /// On branch record `branch`, a share of its length along it; shares are kept within `0..=1`.
    pub fn new(branch: u32, share: f32) -> Self {
        let along = (share.clamp(0.0, 1.0) * ALONG_STEPS).round() as u16;
        Self { branch: branch as u16, along }
    }

    /// How far along, `0..=1`.
    pub fn share(self) -> f32 {
        f32::from(self.along) / ALONG_STEPS
    }
}

/// Largest flexibility.
pub const MOST_FLEXIBLE: f32 = 0.25;

/// Length over thickness at which a branch bends half as far as the most flexible ones. A beam under
/// a load that grows with its thickness bends, for its length, with the cube of this ratio.
const SLENDER: f64 = 45.0;

/// No branch swings faster, in those of the trunk.
const FASTEST: f64 = 4.0;

/// Strongest wind that may be asked for: beyond it branches would curl up.
pub const MOST_STRENGTH: f32 = 2.0;

/// Wind at a moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wind {
    /// Horizontal unit vector that it blows along.
    pub direction: Vec3,
    /// 0 for calm, 1 for a gale.
    pub strength: f32,
    /// Seconds.
    pub time: f32,
    /// Swings of the trunk in a second.
    pub frequency: f32,
}

impl std::str::FromStr for Wind {
    type Err = String;

    /// "STRENGTH" or "STRENGTH,SECONDS": wind from the left of the front view.
    fn from_str(text: &str) -> Result<Self, String> {
        let (strength, time) = text.split_once(',').unwrap_or((text, "0"));
        let number =
            |t: &str, most: f32| t.trim().parse::<f32>().ok().filter(|v| (0.0..=most).contains(v));
        match (number(strength, MOST_STRENGTH), number(time, 1e6)) {
            (Some(strength), Some(time)) => Ok(Self { strength, time, ..Self::default() }),
            _ => Err(format!("a strength from 0 to {MOST_STRENGTH}, or STRENGTH,SECONDS")),
        }
    }
}

impl Default for Wind {
    /// Calm.
    fn default() -> Self {
        Self { direction: Vec3::X, strength: 0.0, time: 0.0, frequency: 0.35 }
    }
}

/// How a branch stands at a moment: 48 bytes, as shaders read them.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct BranchPose {
    /// Rotation of the frame at its base, a quaternion (x, y, z, w).
    pub turn: [f32; 4],
    /// Where its base is.
    pub base: [f32; 3],
    /// By how much its direction has turned at the tip, in radians.
    pub angle: f32,
    /// Unit axis of that turn, in the frame at rest.
    pub axis: [f32; 3],
    /// Nothing yet.
    pub spare: f32,
}

impl BranchRecord {
    /// A branch, by its number, as wind moves it. `leaves` is the area of leaves over that of wood.
    fn new(branch: &Branch, number: u32, at: f32, trunk: f64) -> Self {
        let length = branch.length().max(f32::MIN_POSITIVE.into());
        let (base, linear, square) = parabola(branch);
        let slender = length / (2.0 * branch.base_radius().max(1e-6 * length));
        let load = (slender / SLENDER).powi(3);
        let golden = f64::from(number) * 0.618_033_988_749_895;
        Self {
            base: base.as_vec3().to_array(),
            parent: branch.parent.unwrap_or(NO_BRANCH),
            linear: linear.as_vec3().to_array(),
            at,
            square: square.as_vec3().to_array(),
            length: length as f32,
            flexibility: MOST_FLEXIBLE * (load / (1.0 + load)) as f32,
            phase: golden.fract() as f32,
            frequency: (trunk / length).sqrt().clamp(0.5, FASTEST) as f32,
            level: branch.order,
        }
    }

    fn tip(&self) -> Vec3 {
        Vec3::from(self.linear) + Vec3::from(self.square)
    }

    /// The place `s` along the middle line at rest, about the base.
    fn line(&self, s: f32) -> Vec3 {
        (Vec3::from(self.linear) + Vec3::from(self.square) * s) * s
    }

    /// Where the tip wants to be moved, in lengths: the wind, and across it.
    fn push(&self, wind: &Wind, phase: f32) -> Vec3 {
        let own = Wind { frequency: wind.frequency * self.frequency, ..*wind };
        let [along, across] = own.push(self.phase + phase);
        let push = wind.direction * along
            + wind.direction.cross(Vec3::Y) * across
            + Vec3::Y * (RISE * across);
        push * (wind.strength * self.flexibility)
    }
}

/// How far tips rise and fall, in what they move across the wind.
pub const RISE: f32 = 0.3;

/// Largest angle by which leaves turn in a wind of strength 1, in radians.
pub const FLUTTER: f32 = 0.35;

/// How often leaves turn to and fro in a second.
pub const FLUTTER_FREQUENCY: f32 = 1.7;

/// Mean displacement along the wind.
pub const STEADY: f32 = 0.6;

/// What swings about it, two sines along the wind and two across it: how far, how fast, and where in its
/// swing. Their periods share no multiple soon: gusts do not repeat.
pub const SWINGS: [[f32; 3]; 4] =
    [[0.28, 1.0, 0.0], [0.12, 1.618, 0.3], [0.22, 0.786, 0.5], [0.11, 1.272, 0.7]];

impl Wind {
    /// The factors of the displacements along the wind and across it, of what swings with the wind's
    /// frequency and this phase in turns.
    pub fn push(&self, phase: f32) -> [f32; 2] {
        let swing = |[far, fast, shift]: [f32; 3]| {
            let turns = self.time * self.frequency * fast + phase + shift;
            far * (turns.fract() * std::f32::consts::TAU).sin()
        };
        let [a, b, c, d] = SWINGS.map(swing);
        [STEADY + a + b, c + d]
    }
}

/// The parabola through base and tip of a branch that lies nearest to its line.
fn parabola(branch: &Branch) -> (DVec3, DVec3, DVec3) {
    let (base, tip) = (branch.line[0], branch.line[branch.line.len() - 1]);
    let chord = tip - base;
    let length = branch.length().max(f64::MIN_POSITIVE);
    // line(s) = chord·s + square·(s² − s): one unknown vector, by least squares over the length.
    let (mut sum, mut weight) = (DVec3::ZERO, 0.0);
    for i in 0..STEPS {
        let s = (f64::from(i) + 0.5) / f64::from(STEPS);
        let bow = s * s - s;
        sum += (branch.sample(s * length).0 - base - chord * s) * bow;
        weight += bow * bow;
    }
    let square = sum / weight;
    (base, chord - square, square)
}

/// Samples of a line that its parabola is fitted to.
const STEPS: u32 = 32;

/// Turns `v` about the unit vector `axis`.
fn turned(v: Vec3, axis: Vec3, angle: f32) -> Vec3 {
    let (sin, cos) = angle.sin_cos();
    v * cos + axis.cross(v) * sin + axis * (axis.dot(v) * (1.0 - cos))
}

/// Integrals from 0 to s of cos(θu), sin(θu), 2u·cos(θu) and 2u·sin(θu).
fn integrals(angle: f32, s: f32) -> [f32; 4] {
    let x = angle * s;
    if x.abs() < 0.25 {
        let x2 = x * x;
        return [
            s * (1.0 - x2 / 6.0 * (1.0 - x2 / 20.0)),
            s * x * 0.5 * (1.0 - x2 / 12.0 * (1.0 - x2 / 30.0)),
            s * s * (1.0 - x2 / 4.0 * (1.0 - x2 / 18.0)),
            s * s * x * (2.0 / 3.0) * (1.0 - x2 / 10.0 * (1.0 - x2 / 28.0)),
        ];
    }
    let (sin, cos) = x.sin_cos();
    let per = 1.0 / angle;
    [
        sin * per,
        (1.0 - cos) * per,
        2.0 * per * (s * sin - (1.0 - cos) * per),
        2.0 * per * (sin * per - s * cos),
    ]
}

/// The place `s` along the bent middle line, about the base: the integral of the turned direction.
fn bent(record: &BranchRecord, axis: Vec3, angle: f32, s: f32) -> Vec3 {
    let [c0, s0, c1, s1] = integrals(angle, s);
    let (a, b) = (Vec3::from(record.linear), Vec3::from(record.square));
    let (along_a, along_b) = (axis * axis.dot(a), axis * axis.dot(b));
    along_a * s
        + along_b * (s * s)
        + (a - along_a) * c0
        + axis.cross(a) * s0
        + (b - along_b) * c1
        + axis.cross(b) * s1
}

/// All branches of a tree at a moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pose {
    /// One a branch.
    pub branches: Vec<BranchPose>,
}

impl Pose {
    /// How `records` stand in `wind`; `phase` in turns tells trees of one kind apart.
    ///
    /// # Panics
    /// If a parent does not come before its child.
    pub fn new(records: &[BranchRecord], wind: &Wind, phase: f32) -> Self {
        let mut branches: Vec<BranchPose> = Vec::with_capacity(records.len());
        for record in records {
            let (turn, base) = match record.parent {
                NO_BRANCH => (Quat::IDENTITY, Vec3::from(record.base)),
                parent => {
                    let (parent, pose) = (&records[parent as usize], &branches[parent as usize]);
                    let own = Quat::from_axis_angle(pose.axis.into(), pose.angle * record.at);
                    let turn = (Quat::from_array(pose.turn) * own).normalize();
                    (turn, pose.place(parent, record.base.into(), record.at))
                }
            };
            // The wind as the branch feels it, turned as it is.
            let push = turn.inverse() * record.push(wind, phase);
            let along = record.tip().normalize_or(Vec3::Y);
            let aside = push - along * push.dot(along);
            let axis = along.cross(aside).normalize_or(along.any_orthonormal_vector());
            // A bend of angle θ moves the tip by about θ/2 lengths.
            let angle = 2.0 * aside.length();
            let (turn, base, axis) = (turn.to_array(), base.to_array(), axis.to_array());
            branches.push(BranchPose { turn, base, angle, axis, spare: 0.0 });
        }
        Self { branches }
    }

    /// Where a point is that rests at `p` and hangs on a branch of `records`.
    pub fn place(&self, records: &[BranchRecord], hung: Hung, p: Vec3) -> Vec3 {
        let on = usize::from(hung.branch);
        self.branches[on].place(&records[on], p, hung.share())
    }

    /// Which way a direction points that rests along `v` there.
    pub fn direction(&self, hung: Hung, v: Vec3) -> Vec3 {
        let pose = &self.branches[usize::from(hung.branch)];
        Quat::from_array(pose.turn) * turned(v, pose.axis.into(), pose.angle * hung.share())
    }
}

impl BranchPose {
    fn place(&self, record: &BranchRecord, p: Vec3, s: f32) -> Vec3 {
        let axis = Vec3::from(self.axis);
        let off = p - Vec3::from(record.base) - record.line(s);
        let own = bent(record, axis, self.angle, s) + turned(off, axis, self.angle * s);
        Vec3::from(self.base) + Quat::from_array(self.turn) * own
    }
}

/// Branches as wind moves them, and which of them moves a place.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rig {
    pub(crate) records: Vec<BranchRecord>,
    /// Of each branch, its record, and how far along that it is fixed; `None` if it moves itself.
    fixed: Vec<(u32, Option<f64>)>,
}

impl Rig {
    pub(crate) fn new(branches: &Branches) -> Self {
        let all = &branches.branches;
        let trunk = all.first().map_or(1.0, Branch::length);
        let mut out = Self::default();
        for branch in all {
            let parent = branch.parent.map(|p| out.fixed[p as usize]);
            if branch.order >= MOST_LEVELS {
                let (record, at) = parent.expect("it has an order");
                out.fixed.push((record, Some(at.unwrap_or(branch.at))));
                continue;
            }
            let (number, length) = (out.records.len() as u32, |p: u32| all[p as usize].length());
            let at = branch.parent.map_or(0.0, |p| branch.at / length(p)).clamp(0.0, 1.0);
            let parent = parent.map(|p| p.0);
            let record = BranchRecord::new(branch, number, at as f32, trunk);
            out.records.push(BranchRecord { parent: parent.unwrap_or(NO_BRANCH), ..record });
            out.fixed.push((number, None));
        }
        out
    }

    /// Record and share of its length of a place.
    pub(crate) fn place(&self, on: OnBranch) -> (u32, f32) {
        let (record, at) = self.fixed[on.branch as usize];
        let length = f64::from(self.records[record as usize].length);
        (record, (at.unwrap_or(on.at) / length).clamp(0.0, 1.0) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(linear: Vec3, square: Vec3) -> BranchRecord {
        BranchRecord {
            linear: linear.to_array(),
            square: square.to_array(),
            parent: NO_BRANCH,
            length: linear.length(),
            flexibility: MOST_FLEXIBLE,
            frequency: 1.0,
            ..BranchRecord::default()
        }
    }

    #[test]
    fn integrals_agree_with_sums_across_the_switch_of_formulas() {
        for angle in [0.0f32, 1e-3, 0.1, 0.2499, 0.2501, 0.6, 1.5, -0.7] {
            for s in [0.1f32, 0.5, 1.0] {
                let n = 20_000;
                let mut want = [0.0f64; 4];
                for i in 0..n {
                    let u = f64::from(s) * (f64::from(i) + 0.5) / f64::from(n);
                    let (sin, cos) = (f64::from(angle) * u).sin_cos();
                    let part = f64::from(s) / f64::from(n);
                    let values = [cos, sin, 2.0 * u * cos, 2.0 * u * sin];
                    want.iter_mut().zip(values).for_each(|(w, v)| *w += v * part);
                }
                for (got, want) in integrals(angle, s).iter().zip(want) {
                    assert!((f64::from(*got) - want).abs() < 2e-6, "{angle} {s}: {got} {want}");
                }
            }
        }
    }

    #[test]
    fn calm_moves_nothing_and_a_bent_line_keeps_its_length() {
        let straight = record(Vec3::Y * 3.0, Vec3::ZERO);
        let bow = record(Vec3::new(0.5, 2.0, 0.0), Vec3::new(0.5, -0.7, 0.2));
        for r in [straight, bow] {
            let calm = Pose::new(&[r], &Wind::default(), 0.0);
            let p = Vec3::new(0.3, 1.0, -0.2);
            assert!(calm.place(&[r], Hung::new(0, 0.4), p).distance(p) < 1e-6);
            let gale = Wind { strength: 1.5, time: 3.3, ..Wind::default() };
            let pose = Pose::new(&[r], &gale, 0.1);
            let length = |place: &dyn Fn(f32) -> Vec3| -> f32 {
                let at = |i: u32| place(i as f32 / 200.0);
                (0..200).map(|i| at(i).distance(at(i + 1))).sum()
            };
            let rest = length(&|s| r.line(s));
            let moved = length(&|s| pose.place(&[r], Hung::new(0, s), r.line(s)));
            assert!((moved / rest - 1.0).abs() < 1e-4, "{moved} {rest}");
            let tip = pose.place(&[r], Hung::new(0, 1.0), r.tip());
            assert!(tip.distance(r.tip()) > 0.05 * rest, "the tip moves");
        }
    }
}
