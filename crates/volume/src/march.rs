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
/// Steps go from cell to cell, or over bricks where nothing is (J. Amanatides, A. Woo, "A fast voxel
/// traversal algorithm for ray tracing", 1987). In each brick distances are computed anew from the
/// ray's start, so that errors do not add up.
#[inline]
pub(crate) fn walk(
    cells: &Cells,
    ray: &LocalRay,
    from: f64,
    mut visit: impl FnMut(u32, f64, f64) -> bool,
) {
    let Some(mut at) = Traversal::start(cells.n, ray, from) else { return };
    loop {
        if !cells.has_brick(at.place.as_uvec3()) {
            if !at.skip_brick() {
                return;
            }
            continue;
        }
        let brick = at.place / BRICK as i32;
        let mut walls = at.walls();
        loop {
            let (end, axis) = nearest(walls);
            let cell = cells.at(at.place.as_uvec3());
            if cell != NONE && end > at.t && !visit(cell, at.t, end.min(at.leave)) {
                return;
            }
            // Rounding may put the wall behind: the step is made all the same.
            at.t = at.t.max(end);
            at.place[axis] += at.step[axis];
            walls[axis] += at.width[axis];
            if at.place[axis] < 0 || at.place[axis] > at.last {
                return;
            }
            if at.place[axis] / BRICK as i32 != brick[axis] {
                break;
            }
        }
    }
}

/// The smallest of three, and which it is.
#[inline]
fn nearest([x, y, z]: [f64; 3]) -> (f64, usize) {
    if x < y {
        if x < z { (x, 0) } else { (z, 2) }
    } else if y < z {
        (y, 1)
    } else {
        (z, 2)
    }
}

/// A ray on its way.
struct Traversal<'a> {
    ray: &'a LocalRay,
    inverse: [f64; 3],
    /// Cell that it is in.
    place: IVec3,
    /// Where it entered the cell.
    t: f64,
    /// Where it leaves the lattice.
    leave: f64,
    /// The last cell along each axis.
    last: i32,
    /// To the next cell along each axis: 1 or −1, and the way between two walls.
    step: [i32; 3],
    width: [f64; 3],
}

impl<'a> Traversal<'a> {
    /// Where the ray enters a lattice of `n` cells a side; `None` if it does not.
    #[inline]
    fn start(n: u32, ray: &'a LocalRay, from: f64) -> Option<Self> {
        let (end, inverse) = (f64::from(n), ray.direction.recip().to_array());
        let (mut enter, mut leave) = (from, f64::INFINITY);
        for (k, inverse) in inverse.into_iter().enumerate() {
            // Along a face 0·∞ would say nothing.
            if ray.direction[k] == 0.0 {
                if !(0.0..end).contains(&ray.origin[k]) {
                    return None;
                }
                continue;
            }
            let (a, b) = (-ray.origin[k] * inverse, (end - ray.origin[k]) * inverse);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        if enter >= leave {
            return None;
        }
        let last = n as i32 - 1;
        let start = ray.origin + ray.direction * enter;
        Some(Self {
            ray,
            inverse,
            place: start.floor().as_ivec3().clamp(IVec3::ZERO, IVec3::splat(last)),
            t: enter,
            leave,
            last,
            step: ray.direction.to_array().map(|d| if d > 0.0 { 1 } else { -1 }),
            width: inverse.map(f64::abs),
        })
    }

    /// Where the ray leaves the cell through the walls of each axis.
    #[inline]
    fn walls(&self) -> [f64; 3] {
        std::array::from_fn(|k| self.wall(k, self.place[k] + i32::from(self.step[k] > 0)))
    }

    #[inline]
    fn wall(&self, k: usize, at: i32) -> f64 {
        if self.ray.direction[k] == 0.0 {
            return f64::INFINITY;
        }
        (f64::from(at) - self.ray.origin[k]) * self.inverse[k]
    }

    /// Goes on behind the brick; `false` where the lattice ends.
    #[inline]
    fn skip_brick(&mut self) -> bool {
        let size = BRICK as i32;
        let low = self.place / size * size;
        let beyond = |k: usize| low[k] + if self.step[k] > 0 { size } else { 0 };
        let (end, axis) = nearest(std::array::from_fn(|k| self.wall(k, beyond(k))));
        self.t = self.t.max(end);
        let next = if self.step[axis] > 0 { low[axis] + size } else { low[axis] - 1 };
        let here = (self.ray.origin + self.ray.direction * self.t).floor().as_ivec3();
        self.place = here.clamp(low, (low + (size - 1)).min(IVec3::splat(self.last)));
        self.place[axis] = next;
        (0..=self.last).contains(&next)
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
            let hash = |i: u32| (i ^ seed).wrapping_mul(0x9e37_79b9).rotate_left(13).is_multiple_of(9);
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
