//! Which billboards are never seen: paper 004, section 3.2.
//!
//! A cell that is hidden from a camera needs no billboard for it. But the camera's billboards are
//! drawn for viewers between it and its neighbours too, who look past what hides the cell: holes
//! in the crown would be seen there. So a billboard is left out only where the cell is hidden from
//! the camera and from its neighbours. [`Prune::Own`] asks the camera alone, as the paper does.

use crate::billboards::{CameraBillboards, LevelBillboards};
use crate::cells::Cells;
use crate::frame::CameraFrame;
use crate::options::Prune;
use rayon::prelude::*;

/// Neighbours of a camera: on a sphere a place has six around it.
const NEIGHBOURS: usize = 6;

/// For each camera and level, of each cell whether it is pruned. What is pruned goes with all that
/// it holds: "the pruning strategy is applied recursively to the entire octree structure".
pub(crate) fn pruned(
    levels: &[Cells],
    cameras: &[CameraBillboards],
    frames: &[CameraFrame],
    by: Prune,
) -> Vec<Vec<Vec<bool>>> {
    (0..cameras.len())
        .into_par_iter()
        .map(|camera| {
            let asked = match by {
                Prune::Own => vec![camera],
                Prune::Neighbours => neighbourhood(frames, camera),
            };
            let mut out: Vec<Vec<bool>> = Vec::with_capacity(levels.len());
            for (level, cells) in levels.iter().enumerate() {
                let hidden =
                    |cell: usize| asked.iter().all(|&c| cameras[c].levels[level].hidden[cell]);
                let mut here: Vec<bool> = (0..cells.places.len()).map(hidden).collect();
                if let Some(above) = out.last() {
                    let parents = levels[level - 1].children.iter().zip(above);
                    for (&(first, mask), _) in parents.filter(|(_, pruned)| **pruned) {
                        here[first as usize..first as usize + mask.count_ones() as usize]
                            .fill(true);
                    }
                }
                out.push(here);
            }
            out
        })
        .collect()
}

/// A camera and those whose directions are nearest to its own.
fn neighbourhood(frames: &[CameraFrame], camera: usize) -> Vec<usize> {
    let back = |c: usize| frames[c].axes()[2];
    let mut order: Vec<usize> = (0..frames.len()).collect();
    let near = |c: usize| if c == camera { 2.0 } else { back(camera).dot(back(c)) };
    order.sort_by(|&a, &b| near(b).total_cmp(&near(a)).then(a.cmp(&b)));
    order.truncate(NEIGHBOURS + 1);
    order
}

impl LevelBillboards {
    /// Leaves out billboards of pruned cells.
    pub(crate) fn remove(&mut self, pruned: &[bool], t2: usize) {
        let old = std::mem::take(self);
        for (&cell, texels) in old.cells.iter().zip(old.texels.chunks_exact(t2)) {
            if !pruned[cell as usize] {
                self.cells.push(cell);
                self.texels.extend_from_slice(texels);
            }
        }
    }
}
