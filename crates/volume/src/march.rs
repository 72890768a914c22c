//! Rays through the occupied cells of a level.

use crate::cells::{BRICK, Cells, NONE};
use glam::{DVec3, IVec3};

/// A ray in cells of a level from the lattice's corner. Distances count in the same unit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalRay {
    pub(crate) origin: DVec3,
    /// Unit.
    pub(crate) direction: DVec3,
}

/// Calls `visit` with the number of each occupied cell that the ray meets from the distance `from`
/// on, in order, and where it enters and leaves the cell; until `visit` says `false`.
///
/// Steps go from cell to cell, or from brick to brick where nothing is (J. Amanatides, A. Woo, "A
/// fast voxel traversal algorithm for ray tracing", 1987); where a step leads is computed from
/// the ray's start each time, so that errors do not add up.
#[inline]
pub(crate) fn walk(
    cells: &Cells,
    ray: &LocalRay,
    from: f64,
    mut visit: impl FnMut(u32, f64, f64) -> bool,
) {
    let n = f64::from(cells.n);
    let inverse = ray.direction.recip();
    // Where the ray is within the lattice. A ray along a face is inside where 0·∞ says nothing.
    let (mut enter, mut leave) = (from, f64::INFINITY);
    for k in 0..3 {
        if ray.direction[k] == 0.0 {
            if !(0.0..n).contains(&ray.origin[k]) {
                return;
            }
            continue;
        }
        let (a, b) = (-ray.origin[k] * inverse[k], (n - ray.origin[k]) * inverse[k]);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    if enter >= leave {
        return;
    }
    let last = cells.n as i32 - 1;
    let start = ray.origin + ray.direction * enter;
    let mut place = start.floor().as_ivec3().clamp(IVec3::ZERO, IVec3::splat(last));
    let mut t = enter;
    loop {
        let at = place.as_uvec3();
        let size = if cells.has_brick(at) { 1 } else { BRICK as i32 };
        let low = place / size * size;
        let mut exit = (f64::INFINITY, 0);
        for k in 0..3 {
            if ray.direction[k] != 0.0 {
                let wall = low[k] + if ray.direction[k] > 0.0 { size } else { 0 };
                let t = (f64::from(wall) - ray.origin[k]) * inverse[k];
                if t < exit.0 {
                    exit = (t, k);
                }
            }
        }
        let (end, axis) = exit;
        if size == 1 {
            let cell = cells.at(at);
            if cell != NONE && end > t && !visit(cell, t, end.min(leave)) {
                return;
            }
        }
        // Rounding may put the wall behind: the step is made all the same.
        t = t.max(end);
        let next = if ray.direction[axis] > 0.0 { low[axis] + size } else { low[axis] - 1 };
        if next < 0 || next > last {
            return;
        }
        if size > 1 {
            let here = (ray.origin + ray.direction * t).floor().as_ivec3();
            place = here.clamp(low, (low + (size - 1)).min(IVec3::splat(last)));
        }
        place[axis] = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cells::{Opacity, cells};
    use crate::lattice::{Branching, Lattice};
    use proptest::prelude::*;

    proptest! {
        /// Against boxes tried one by one.
        #[test]
        fn meets_every_box_in_order(
            seed in 0u32..1000, tri: bool,
            from in prop::array::uniform3(-0.3f64..1.3), to in prop::array::uniform3(-0.3f64..1.3),
            flat in 0usize..4,
        ) {
            let branching = if tri { Branching::TriGrid } else { Branching::Octree };
            let levels = if tri { 2 } else { 4 };
            let lattice = Lattice { corner: DVec3::ZERO, side: 1.0, branching, levels };
            let n = lattice.cells(levels);
            let hash = |i: u32| (i ^ seed).wrapping_mul(0x9e37_79b9).rotate_left(13) % 9 == 0;
            let finest: Vec<f32> = (0..n * n * n).map(|i| f32::from(u8::from(hash(i)))).collect();
            let level = cells(&lattice, &Opacity::from_finest(&lattice, finest)).pop().unwrap();
            let (from, mut to) = (DVec3::from_array(from), DVec3::from_array(to));
            if flat < 3 {
                to[flat] = from[flat];
            }
            prop_assume!(from.distance(to) > 1e-3);
            let origin = lattice.local(levels, from);
            let ray = LocalRay { origin, direction: (to - from).normalize() };
            let mut met = Vec::new();
            walk(&level, &ray, 0.0, |cell, a, b| { met.push((cell, a, b)); true });
            let mut want = Vec::new();
            for (i, p) in (0u32..).zip(&level.places) {
                let (low, high) = (p.as_dvec3(), p.as_dvec3() + 1.0);
                let (mut a, mut b) = (0.0f64, f64::INFINITY);
                for k in 0..3 {
                    if ray.direction[k] == 0.0 {
                        if origin[k] < low[k] || origin[k] >= high[k] { a = f64::INFINITY; }
                        continue;
                    }
                    let (u, v) = ((low[k] - origin[k]) / ray.direction[k], (high[k] - origin[k]) / ray.direction[k]);
                    a = a.max(u.min(v));
                    b = b.min(u.max(v));
                }
                if b - a > 1e-9 { want.push((i, a, b)); }
            }
            want.sort_by(|a, b| a.1.total_cmp(&b.1));
            met.retain(|m| m.2 - m.1 > 1e-9);
            prop_assert_eq!(met.len(), want.len());
            for (m, w) in met.iter().zip(&want) {
                prop_assert_eq!(m.0, w.0);
                prop_assert!((m.1 - w.1).abs() < 1e-9 && (m.2 - w.2).abs() < 1e-9);
            }
        }
    }
}
