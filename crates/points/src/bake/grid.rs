//! The regular grid over a block (Gilet et al. 2005, section 4.1).

use crate::bake::frame::BlockFrame;
use crate::options::GridChoice;
use forest_soup::{Bounds, TriangleSoup};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Cells along x, y (up) and z.
fn dimensions(choice: GridChoice, bounds: Bounds) -> [u32; 3] {
    match choice {
        GridChoice::Fixed(n) => n.map(|n| n.max(1)),
        GridChoice::Budget(budget) => near_cubes(bounds.size(), budget.max(1)),
    }
}

/// At most `budget` cells of the box, as near to cubes as they come: the longest edge of a cell is
/// halved (by one more cell along it) until the budget is used up.
fn near_cubes(size: DVec3, budget: u32) -> [u32; 3] {
    let mut n = [1u32; 3];
    loop {
        let edge: [f64; 3] = std::array::from_fn(|a| size[a] / f64::from(n[a]));
        let longest = (0..3).fold(0, |best, a| if edge[a] > edge[best] { a } else { best });
        let mut next = n;
        next[longest] += 1;
        if next.iter().map(|&n| u64::from(n)).product::<u64>() > u64::from(budget) {
            return n;
        }
        n = next;
    }
}

/// The cells of a block.
pub(crate) struct Grid {
    pub(crate) frame: BlockFrame,
    pub(crate) dims: [u32; 3],
    cells_per_unit: DVec3,
}

/// The cell of a triangle of which a corner is NaN or infinite.
pub(crate) const NO_CELL: u32 = u32::MAX;

impl Grid {
    pub(crate) fn new(frame: BlockFrame, choice: GridChoice) -> Self {
        let dims = dimensions(choice, frame.bounds);
        let size = frame.bounds.size();
        let cells_per_unit = DVec3::from_array(std::array::from_fn(|a| {
            if size[a] > 0.0 { f64::from(dims[a]) / size[a] } else { 0.0 }
        }));
        Self { frame, dims, cells_per_unit }
    }

    /// Cells in all.
    pub(crate) fn len(&self) -> usize {
        self.dims.iter().map(|&n| n as usize).product()
    }

    /// The cell of a triangle's centroid, or [`NO_CELL`].
    pub(crate) fn cell_of(&self, corners: [Vec3; 3]) -> u32 {
        if !corners.iter().all(|p| p.is_finite()) {
            return NO_CELL;
        }
        let [a, b, c] = corners.map(|p| self.frame.map(p));
        let at = (sum(a, b, c) / 3.0 - self.frame.bounds.min) * self.cells_per_unit;
        let [x, y, z]: [u32; 3] = std::array::from_fn(|k| (at[k] as u32).min(self.dims[k] - 1));
        (y * self.dims[2] + z) * self.dims[0] + x
    }
}

/// a + b + c, rounded alike whatever the order: duplicates of a triangle must meet in one cell.
fn sum(a: DVec3, b: DVec3, c: DVec3) -> DVec3 {
    let (low, high) = (a.min(b), a.max(b));
    let middle = low.max(high.min(c));
    low.min(c) + high.max(c) + middle
}

/// Triangles by cell.
pub(crate) struct CellLists {
    /// Cell `c` holds `triangles[starts[c]..starts[c + 1]]`.
    pub(crate) starts: Vec<u32>,
    /// Triangle indices, ascending within a cell.
    pub(crate) triangles: Vec<u32>,
    /// Triangles left out because a corner is NaN or infinite.
    pub(crate) non_finite: u64,
}

impl CellLists {
    /// Sorts triangles into the cells of their centroids.
    pub(crate) fn new(soup: &TriangleSoup, grid: &Grid) -> Self {
        let cells = grid.len();
        let cell_of = |i: usize| grid.cell_of(soup.corners(i));
        let of: Vec<u32> =
            (0..soup.triangles.len()).into_par_iter().with_min_len(1 << 14).map(cell_of).collect();

        let mut starts = vec![0u32; cells + 1];
        let mut non_finite = 0;
        for &c in &of {
            match starts.get_mut(c as usize + 1) {
                Some(count) => *count += 1,
                None => non_finite += 1,
            }
        }
        for c in 0..cells {
            starts[c + 1] += starts[c];
        }
        let mut next = starts.clone();
        let mut triangles = vec![0u32; starts[cells] as usize];
        for (i, &c) in of.iter().enumerate() {
            if c != NO_CELL {
                triangles[next[c as usize] as usize] = i as u32;
                next[c as usize] += 1;
            }
        }
        Self { starts, triangles, non_finite }
    }

    pub(crate) fn len(&self) -> usize {
        self.starts.len() - 1
    }

    pub(crate) fn of(&self, cell: usize) -> &[u32] {
        &self.triangles[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_gets_the_papers_grid_and_a_tall_box_its_own() {
        assert_eq!(near_cubes(DVec3::ONE, 64), [4, 4, 4]);
        assert_eq!(near_cubes(DVec3::new(4.0, 1.0, 4.0), 1024), [16, 4, 16]);
        let tall = near_cubes(DVec3::new(1.0, 16.0, 1.0), 64);
        assert!(tall[1] >= 16 && tall.iter().product::<u32>() <= 64, "{tall:?}");
        assert_eq!(near_cubes(DVec3::new(1.0, 0.0, 0.0), 64), [64, 1, 1]);
        assert_eq!(near_cubes(DVec3::ONE, 1), [1, 1, 1]);
    }
}
