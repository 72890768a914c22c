//! What panels hang on: one branch record each, and how far along it each corner moves.

use crate::wind::{BranchRecord, NO_BRANCH};
use glam::DVec3;

/// A part of what a panel shows, and where it grows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grown {
    pub(crate) place: DVec3,
    pub(crate) area: f64,
    /// Branch record and share of its length.
    pub(crate) on: (u32, f32),
}

/// The deepest record on which, with all that grows from it, half of the area or more hangs: a panel
/// across several branches moves with what they share, not with one of them.
pub(crate) fn holder(records: &[BranchRecord], grown: &[Grown]) -> u32 {
    let mut areas = hashbrown::HashMap::<u32, f64>::new();
    let mut total = 0.0;
    for g in grown {
        total += g.area;
        let mut record = g.on.0;
        while record != NO_BRANCH {
            *areas.entry(record).or_default() += g.area;
            record = records[record as usize].parent;
        }
    }
    let holds = areas.into_iter().filter(|(_, area)| *area >= 0.5 * total).map(|(r, _)| r);
    // Parents have smaller numbers; of two halves the first.
    let level = |r: &u32| records[*r as usize].level;
    holds.max_by_key(|r| (level(r), std::cmp::Reverse(*r))).unwrap_or(0)
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

/// Shares of the length of `record` at which `corners` move: those of what grows near them, weighted
/// with its area over the square of its distance; nearer than `near` counts as that far.
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
        let (mut sum, mut weight) = (0.0, f64::MIN_POSITIVE);
        for (place, area, at) in &known {
            let w = area / (place.distance_squared(*corner) + near * near);
            sum += w * at;
            weight += w;
        }
        (sum / weight) as f32
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

    #[test]
    fn a_panel_hangs_on_what_holds_half_of_it() {
        let r = records();
        assert_eq!(holder(&r, &[grown(0.0, 3.0, (3, 1.0)), grown(1.0, 1.0, (1, 1.0))]), 3);
        assert_eq!(holder(&r, &[grown(0.0, 1.0, (3, 1.0)), grown(1.0, 2.0, (2, 1.0))]), 2);
        // No branch has half: the trunk does.
        let thirds = [(1, 0.5), (3, 0.5), (0, 0.5)].map(|on| grown(0.0, 1.0, on));
        assert_eq!(holder(&r, &thirds), 0);
        assert_eq!(holder(&r, &[grown(0.0, 1.0, (1, 0.5)), grown(0.0, 1.0, (2, 0.5))]), 1);
        assert_eq!(holder(&r, &[]), 0);
    }

    #[test]
    fn corners_move_as_what_grows_near_them() {
        let r = records();
        // On the branch itself at its tip; on its branch, which leaves it at 0.25; elsewhere.
        let all = [grown(0.0, 1.0, (2, 1.0)), grown(1.0, 1.0, (3, 0.9)), grown(0.5, 9.0, (1, 0.1))];
        let corners = [0.0, 0.5, 1.0].map(|x| DVec3::X * x);
        let got = shares(&r, 2, &all, &corners, 0.1);
        // Weights 1/0.01 and 1/1.01.
        let end = (100.0 + 0.25 / 1.01) / (100.0 + 1.0 / 1.01);
        let want = [end, 0.625, 1.25 - end];
        for (got, want) in got.iter().zip(want) {
            assert!((f64::from(*got) - want).abs() < 1e-6, "{got} {want}");
        }
    }
}
