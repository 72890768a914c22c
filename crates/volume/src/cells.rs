//! The occupied cells of each level, and what they hold back.

use crate::lattice::Lattice;
use glam::UVec3;

/// No cell.
pub(crate) const NONE: u32 = u32::MAX;

/// Cells along a side of a brick: what rays skip at once.
pub(crate) const BRICK: u32 = 4;

/// Opacity in `0..1` of every cell of every level, in dense arrays ([`Lattice::dense`]): the share
/// of parallel rays through the cell, in the mean over directions, that it stops. 0 is empty.
pub(crate) struct Opacity(pub(crate) Vec<Vec<f32>>);

/// One level's occupied cells: the children of a cell stand together, in the order of their
/// parents and then of their numbers.
#[derive(Clone, Debug)]
pub(crate) struct Cells {
    /// Cells along an axis.
    pub(crate) n: u32,
    pub(crate) places: Vec<UVec3>,
    /// In `0..1`, > 0.
    pub(crate) opacity: Vec<f32>,
    /// Index of the first child and bits of those that are there; of the finest level empty.
    pub(crate) children: Vec<(u32, u32)>,
    /// Number of each place's cell, or [`NONE`].
    index: Vec<u32>,
    /// Bricks that hold a cell.
    bricks: Vec<bool>,
}

impl Cells {
    /// Number of the cell at `place`, or [`NONE`].
    #[inline]
    pub(crate) fn at(&self, place: UVec3) -> u32 {
        let n = self.n as usize;
        self.index[(place.z as usize * n + place.y as usize) * n + place.x as usize]
    }

    /// Whether the brick around `place` holds a cell.
    #[inline]
    pub(crate) fn has_brick(&self, place: UVec3) -> bool {
        self.bricks[brick(self.n, place)]
    }

    /// Cells at `places` of a level with `n` along an axis.
    pub(crate) fn new(n: u32, places: Vec<UVec3>, opacity: Vec<f32>) -> Self {
        let mut index = vec![NONE; (n as usize).pow(3)];
        let mut bricks = vec![false; (n.div_ceil(BRICK) as usize).pow(3)];
        let side = n as usize;
        for (i, &p) in (0..).zip(&places) {
            index[(p.z as usize * side + p.y as usize) * side + p.x as usize] = i;
            bricks[brick(n, p)] = true;
        }
        Self { n, places, opacity, children: Vec::new(), index, bricks }
    }

    /// Those of `level` at `places`, their opacity taken from a dense array.
    fn of_places(lattice: &Lattice, level: u32, places: Vec<UVec3>, opacity: &[f32]) -> Self {
        let opacity = places.iter().map(|&p| opacity[lattice.dense(level, p)]).collect();
        Self::new(lattice.cells(level), places, opacity)
    }
}

fn brick(n: u32, place: UVec3) -> usize {
    let m = n.div_ceil(BRICK) as usize;
    let b = place / BRICK;
    (b.z as usize * m + b.y as usize) * m + b.x as usize
}

/// The occupied cells of all levels, from the root down.
pub(crate) fn cells(lattice: &Lattice, opacity: &Opacity) -> Vec<Cells> {
    let root = vec![UVec3::ZERO];
    let mut levels = vec![Cells::of_places(lattice, 0, root, &opacity.0[0])];
    let (branching, factor) = (lattice.branching, lattice.branching.factor());
    for level in 1..=lattice.levels {
        let dense = &opacity.0[level as usize];
        let mut places = Vec::new();
        let parents = levels.last_mut().expect("a root");
        for &parent in &parents.places {
            let (first, mut mask) = (places.len() as u32, 0);
            for child in 0..branching.children() {
                let place = parent * factor + branching.place(child);
                if dense[lattice.dense(level, place)] > 0.0 {
                    mask |= 1 << child;
                    places.push(place);
                }
            }
            parents.children.push((first, mask));
        }
        levels.push(Cells::of_places(lattice, level, places, dense));
    }
    levels
}

impl Opacity {
    /// Coarser levels from the finest alone, as if what its cells hold were unrelated: a cell stops
    /// what its columns of children stop one after the other, in the mean over the three axes.
    pub(crate) fn from_finest(lattice: &Lattice, finest: Vec<f32>) -> Self {
        let mut levels = vec![finest];
        let f = lattice.branching.factor();
        for level in (0..lattice.levels).rev() {
            let below = levels.last().expect("the finest");
            let n = lattice.cells(level);
            let mut out = vec![0.0; (n as usize).pow(3)];
            for (i, to) in (0u32..).zip(&mut out) {
                let parent = UVec3::new(i % n, i / n % n, i / (n * n)) * f;
                let mut through = 0.0;
                for axis in 0..3 {
                    for (a, b) in (0..f).flat_map(|a| (0..f).map(move |b| (a, b))) {
                        through += (0..f)
                            .map(|c| {
                                let mut at = [a, b, c];
                                at.swap(axis, 2);
                                let place = parent + UVec3::from_array(at);
                                1.0 - below[lattice.dense(level + 1, place)]
                            })
                            .product::<f32>();
                    }
                }
                let open = through / (3 * f * f) as f32;
                // What holds something is not lost to rounding.
                *to = if open < 1.0 { 1.0 - open } else { 0.0 };
            }
            levels.push(out);
        }
        levels.reverse();
        Self(levels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::Branching;
    use glam::DVec3;

    fn lattice(branching: Branching, levels: u32) -> Lattice {
        Lattice { corner: DVec3::ZERO, side: 1.0, branching, levels }
    }

    #[test]
    fn children_stand_together_in_order() {
        for branching in [Branching::Octree, Branching::TriGrid] {
            let lattice = lattice(branching, 3);
            let n = lattice.cells(3);
            let mut finest = vec![0.0; (n as usize).pow(3)];
            for (i, v) in finest.iter_mut().enumerate().step_by(7) {
                *v = 0.1 + 0.5 * (i % 3) as f32;
            }
            let levels = cells(&lattice, &Opacity::from_finest(&lattice, finest.clone()));
            assert_eq!(levels[3].places.len(), finest.iter().filter(|v| **v > 0.0).count());
            for (above, below) in levels.iter().zip(&levels[1..]) {
                let mut next = 0;
                for (i, &(first, mask)) in above.children.iter().enumerate() {
                    assert_eq!(first, next);
                    assert!(mask != 0);
                    for child in (0..branching.children()).filter(|c| mask >> c & 1 == 1) {
                        let place = below.places[next as usize];
                        assert_eq!(place / branching.factor(), above.places[i]);
                        assert_eq!(branching.child(place), child);
                        assert_eq!(below.at(place), next);
                        assert!(below.has_brick(place));
                        next += 1;
                    }
                }
                assert_eq!(next as usize, below.places.len());
            }
        }
    }

    #[test]
    fn a_parent_stops_what_its_columns_stop() {
        let lattice = lattice(Branching::Octree, 1);
        let mut finest = vec![0.0; 8];
        finest[0] = 0.5;
        finest[1] = 0.5; // the neighbour along x
        let root = Opacity::from_finest(&lattice, finest).0[0][0];
        // Along x one column in four stops ¾; along y and z two in four stop ½.
        let want = (0.75 / 4.0 + 0.25 + 0.25) / 3.0;
        assert!((root - want).abs() < 1e-6, "{root}");
    }
}
