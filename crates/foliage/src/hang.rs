//! What panels hang on: one branch record each, and how far along it each corner moves.

use crate::wind::{BranchRecord, Hung, NO_BRANCH, Pose, Wind};
use glam::{DMat3, DVec3, Vec3};

/// A part of what a panel shows, and where it grows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grown {
    pub(crate) place: DVec3,
    pub(crate) area: f64,
    /// Branch record and share of its length.
    pub(crate) on: (u32, f32),
}

/// Moments of a gale from the side and from the front: what moves alike in these moves alike.
#[derive(Clone, Debug)]
pub(crate) struct Gale(Vec<Pose>);

/// Moments from each side, and the seconds between them: swings of long and short branches are met at many
/// places of their turns.
const MOMENTS: u8 = 3;
const APART: f32 = 2.3;

impl Gale {
    pub(crate) fn new(records: &[BranchRecord]) -> Self {
        let moment = |(direction, k): (Vec3, u8)| {
            let time = 1.1 + APART * f32::from(k);
            Pose::new(records, &Wind { direction, strength: 1.0, time, ..Wind::default() }, 0.0)
        };
        let sides = [Vec3::X, Vec3::Z].into_iter();
        Self(sides.flat_map(|d| (0..MOMENTS).map(move |k| (d, k))).map(moment).collect())
    }

    /// How far something moves in each moment.
    fn moves<'a>(
        &'a self,
        records: &'a [BranchRecord],
        (on, share): (u32, f32),
        place: DVec3,
    ) -> impl Iterator<Item = DVec3> + 'a {
        let (rest, hung) = (place.as_vec3(), Hung::new(on, share));
        self.0.iter().map(move |pose| (pose.place(records, hung, rest) - rest).as_dvec3())
    }
}

/// What the square of an error that swings counts for, beside that of one that stays: over many panels the first
/// goes away in the mean, and the crown leans by the second.
const SWING: f64 = 0.1;

/// Branches that are tried, and parts that are asked how they move.
const TRIED: usize = 24;
const ASKED: usize = 64;

/// The record that moves what grows on it most nearly as all of `grown` move in the mean, over the moments of a
/// gale. On the branch that holds all of it a panel would stand still while its twigs bend; on one of many twigs it
/// would swing alone.
pub(crate) fn mover(records: &[BranchRecord], gale: &Gale, grown: &[Grown]) -> u32 {
    let mut areas = hashbrown::HashMap::<u32, f64>::new();
    for g in grown {
        let mut record = g.on.0;
        while record != NO_BRANCH {
            *areas.entry(record).or_default() += g.area;
            record = records[record as usize].parent;
        }
    }
    let mut tried: Vec<(u32, f64)> = areas.into_iter().collect();
    // The deepest of those that hold as much; then the first.
    let depth = |r: u32| std::cmp::Reverse(records[r as usize].level);
    tried.sort_by(|a, b| b.1.total_cmp(&a.1).then(depth(a.0).cmp(&depth(b.0))).then(a.0.cmp(&b.0)));
    tried.truncate(TRIED);
    let step = grown.len().div_ceil(ASKED).max(1);
    let asked: Vec<&Grown> = grown.iter().step_by(step).collect();
    let mean = |on: &dyn Fn(&Grown) -> (u32, f32)| {
        let mut sums = vec![DVec3::ZERO; gale.0.len()];
        for g in &asked {
            let moves = gale.moves(records, on(g), g.place);
            sums.iter_mut().zip(moves).for_each(|(sum, m)| *sum += m * g.area);
        }
        sums
    };
    let want = mean(&|g| g.on);
    let error = |record: u32| -> f64 {
        // What grows elsewhere moves as the mean of what grows here.
        let own: Vec<(f64, f64)> = asked
            .iter()
            .filter_map(|g| Some((g.area, seen_from(records, record, g.on)?.into())))
            .collect();
        let area: f64 = own.iter().map(|o| o.0).sum();
        let share = own.iter().map(|(a, s)| a * s).sum::<f64>() / area.max(f64::MIN_POSITIVE);
        let got = mean(&|g| (record, seen_from(records, record, g.on).unwrap_or(share as f32)));
        let off: Vec<DVec3> = want.iter().zip(got).map(|(w, g)| g - w).collect();
        let side = |moments: &[DVec3]| {
            let mean = moments.iter().sum::<DVec3>() / moments.len() as f64;
            let swing: f64 = moments.iter().map(|m| m.distance_squared(mean)).sum();
            mean.length_squared() * moments.len() as f64 + SWING * swing
        };
        off.chunks(MOMENTS.into()).map(side).sum()
    };
    let best = tried.into_iter().map(|(record, _)| (record, error(record)));
    best.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |best| best.0)
}

/// Where on `record` something grows whose own place is `on`; `None` if it grows elsewhere.
fn seen_from(records: &[BranchRecord], record: u32, mut on: (u32, f32)) -> Option<f32> {
    while on.0 != record {
        let own = &records[on.0 as usize];
        if own.parent == NO_BRANCH {
            return None;
        }
        on = (own.parent, own.at);
    }
    Some(on.1)
}

/// Shares of the length of `record` at which `corners` move, as what grows near them: a plane through the shares of
/// that, by least squares about each corner (P. Lancaster, K. Salkauskas, "Surfaces generated by moving least
/// squares methods", 1981), weighted with area over the square of the distance; nearer than `near` counts as
/// that far. A mean instead would draw corners, which lie outside, towards the middle, and the crown's rim
/// would move too little.
pub(crate) fn shares(
    records: &[BranchRecord],
    record: u32,
    grown: &[Grown],
    corners: &[DVec3],
    near: f64,
) -> Vec<f32> {
    let known: Vec<(DVec3, f64, f64)> = grown
        .iter()
        .filter_map(|g| Some((g.place, g.area, seen_from(records, record, g.on)?.into())))
        .collect();
    let share = |corner: &DVec3| {
        let weights: Vec<f64> = known
            .iter()
            .map(|(place, area, _)| area / (place.distance_squared(*corner) + near * near))
            .collect();
        let total: f64 = weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let parts = || known.iter().zip(&weights).map(|((p, _, s), w)| (*p, *s, w / total));
        let (place, at) = parts()
            .fold((DVec3::ZERO, 0.0), |(p, s), (place, share, w)| (p + place * w, s + share * w));
        let (mut spread, mut slope) = (DMat3::ZERO, DVec3::ZERO);
        for (p, s, w) in parts() {
            let off = p - place;
            spread += DMat3::from_cols(off * off.x, off * off.y, off * off.z) * w;
            slope += off * ((s - at) * w);
        }
        // Across what is flat, or a line, nothing is known: it counts as level.
        let grain = near * near;
        let gradient = (spread + DMat3::from_diagonal(DVec3::splat(grain))).inverse() * slope;
        (at + gradient.dot(*corner - place)).clamp(0.0, 1.0) as f32
    };
    corners.iter().map(share).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A trunk, two branches of it at 0.5 and 0.8, and a branch of the second at 0.25.
    fn records() -> [BranchRecord; 4] {
        let record =
            |parent, at, level| BranchRecord { parent, at, level, ..BranchRecord::default() };
        [record(NO_BRANCH, 0.0, 0), record(0, 0.5, 1), record(0, 0.8, 1), record(2, 0.25, 2)]
    }

    fn grown(x: f64, area: f64, on: (u32, f32)) -> Grown {
        Grown { place: DVec3::X * x, area, on }
    }

    /// The same, with lengths: all of them bend, and the twigs bend most.
    fn bending() -> Vec<BranchRecord> {
        let lines = [Vec3::Y * 4.0, Vec3::X * 2.0, Vec3::X * 2.0, Vec3::new(0.0, 0.5, 1.0)];
        let bases = [Vec3::ZERO, Vec3::Y * 2.0, Vec3::Y * 3.2, Vec3::new(0.5, 3.2, 0.0)];
        let mut all = records().to_vec();
        for (k, r) in all.iter_mut().enumerate() {
            r.base = bases[k].to_array();
            r.linear = lines[k].to_array();
            r.length = lines[k].length();
            r.flexibility = 0.02 + 0.06 * k as f32;
            r.frequency = 1.0 + 0.5 * k as f32;
            r.phase = 0.3 * k as f32;
        }
        all
    }

    #[test]
    fn a_panel_hangs_on_what_moves_as_it_does() {
        let r = bending();
        let gale = Gale::new(&r);
        let on = |of: &[(f64, (u32, f32))]| {
            let tip = |&(area, on): &(f64, (u32, f32))| {
                let b = &r[on.0 as usize];
                let place = Vec3::from(b.base) + Vec3::from(b.linear) * on.1;
                Grown { place: place.as_dvec3(), area, on }
            };
            mover(&r, &gale, &of.iter().map(tip).collect::<Vec<_>>())
        };
        assert_eq!(on(&[(1.0, (3, 0.9))]), 3, "its own");
        assert_eq!(on(&[(9.0, (3, 0.9)), (1.0, (2, 0.5))]), 3, "what most of it hangs on");
        assert_eq!(on(&[(9.0, (2, 0.5)), (1.0, (3, 0.2))]), 2);
        assert_eq!(on(&[(1.0, (0, 0.4)), (1.0, (0, 0.8))]), 0);
        assert_eq!(on(&[]), 0);
    }

    #[test]
    fn corners_move_as_what_grows_near_them() {
        let r = records();
        // Along branch 2, and of its branch that leaves it at 0.25; what grows elsewhere says nothing.
        let along = |x: f64| grown(x, 1.0 + x, (2, 0.3 + 0.4 * x as f32));
        let mut all: Vec<Grown> = (0..9).map(|k| along(f64::from(k) / 8.0)).collect();
        all.push(grown(0.5, 99.0, (1, 0.1)));
        // Beyond both ends the plane goes on, as far as a branch goes; across the line it is level.
        let corners = [DVec3::X * -0.5, DVec3::X * 1.25, DVec3::new(0.5, 0.3, 0.0), DVec3::X * 9.0];
        let got = shares(&r, 2, &all, &corners, 1e-3);
        for (got, want) in got.iter().zip([0.1f32, 0.8, 0.5, 1.0]) {
            assert!((got - want).abs() < 1e-3, "{got} {want}");
        }
        let twigs = [grown(0.0, 1.0, (3, 0.9)), grown(1.0, 1.0, (3, 0.1))];
        let fixed = shares(&r, 2, &twigs, &corners, 1e-3);
        assert!(fixed.iter().all(|s| (s - 0.25).abs() < 1e-6), "{fixed:?}");
        assert_eq!(shares(&r, 2, &[], &corners, 1e-3), [0.0; 4]);
    }
}
