//! The cube that holds a tree, cut again and again.

use glam::{DVec3, UVec3};
use serde::{Deserialize, Serialize};

/// Into how many parts a cell is cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Branching {
    /// 2 × 2 × 2 (paper 004, section 3.1).
    Octree,
    /// 3 × 3 × 3, as in Reche, Martin, Drettakis 2004 (section 2.1 of paper 004).
    TriGrid,
}

impl Branching {
    /// Parts along an axis.
    pub fn factor(self) -> u32 {
        match self {
            Self::Octree => 2,
            Self::TriGrid => 3,
        }
    }

    /// Children of a cell.
    pub fn children(self) -> u32 {
        self.factor().pow(3)
    }

    /// Most levels below the root: cells along an axis stay below 256.
    pub const fn most_levels(self) -> u32 {
        match self {
            Self::Octree => 8,
            Self::TriGrid => 5,
        }
    }

    /// Levels below the root that the paper uses (section 6).
    pub fn usual_levels(self) -> u32 {
        match self {
            Self::Octree => 7,
            Self::TriGrid => 5,
        }
    }

    /// Number of a child among its siblings: x, then y, then z.
    pub fn child(self, place: UVec3) -> u32 {
        let f = self.factor();
        let p = place % f;
        (p.z * f + p.y) * f + p.x
    }

    /// The place of child number `child` in its parent.
    pub fn place(self, child: u32) -> UVec3 {
        let f = self.factor();
        UVec3::new(child % f, child / f % f, child / (f * f))
    }
}

/// A cube and how it is cut. Level 0 is the cube itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// Corner of the cube with the smallest coordinates, in the world.
    pub corner: DVec3,
    /// Side of the cube in world units, > 0.
    pub side: f64,
    /// How cells are cut.
    pub branching: Branching,
    /// Levels below the root.
    pub levels: u32,
}

impl Lattice {
    /// Cells along an axis of `level`.
    pub fn cells(&self, level: u32) -> u32 {
        self.branching.factor().pow(level)
    }

    /// Side of a cell of `level`, in world units.
    pub fn cell_side(&self, level: u32) -> f64 {
        self.side / f64::from(self.cells(level))
    }

    /// World position of the middle of a cell.
    pub fn center(&self, level: u32, place: UVec3) -> DVec3 {
        self.corner + (place.as_dvec3() + 0.5) * self.cell_side(level)
    }

    /// World position in cells of `level` from the corner.
    pub fn local(&self, level: u32, world: DVec3) -> DVec3 {
        (world - self.corner) / self.cell_side(level)
    }

    /// The middle of the cube.
    pub fn middle(&self) -> DVec3 {
        self.corner + 0.5 * self.side
    }

    /// Index of a place in dense arrays over `level`.
    pub(crate) fn dense(&self, level: u32, place: UVec3) -> usize {
        let n = self.cells(level) as usize;
        (place.z as usize * n + place.y as usize) * n + place.x as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn children_are_numbered_and_found() {
        for branching in [Branching::Octree, Branching::TriGrid] {
            for child in 0..branching.children() {
                assert_eq!(branching.child(branching.place(child)), child);
            }
            assert!(branching.factor().pow(branching.most_levels()) <= 256);
            assert!(branching.usual_levels() <= branching.most_levels());
        }
    }

    #[test]
    fn centers_and_local_places_agree() {
        let corner = DVec3::new(1e6, 2.0, -3.0);
        let lattice = Lattice { corner, side: 12.0, branching: Branching::TriGrid, levels: 3 };
        assert_eq!(lattice.cells(2), 9);
        let place = UVec3::new(8, 0, 4);
        let center = lattice.center(2, place);
        assert!((center - DVec3::new(1e6 + 34.0 / 3.0, 2.0 + 2.0 / 3.0, 3.0)).length() < 1e-9);
        assert!((lattice.local(2, center) - DVec3::new(8.5, 0.5, 4.5)).length() < 1e-9);
        assert_eq!(lattice.dense(2, place), (4 * 9) * 9 + 8);
    }
}
