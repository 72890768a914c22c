//! Textures of a level from those of the level below: the way that paper 004 compares with.

use crate::billboards::LevelBillboards;
use crate::cells::Cells;
use crate::frame::CameraFrame;
use crate::lattice::Lattice;
use forest_soup::{linear_to_srgb8, srgb8_to_linear};
use glam::DVec3;

/// Samples along the side of a texel.
const SAMPLES: u32 = 4;

/// A child's billboard, in cells of the parent's level about the parent's middle.
struct Child<'a> {
    /// Of its middle: right, up.
    at: [f64; 2],
    back: f64,
    texels: &'a [[u8; 4]],
}

/// The billboards of `level`, whose `cells` have children with billboards `below`: theirs, one over
/// the other, averaged in linear light.
pub(crate) fn average(
    lattice: &Lattice,
    cells: &Cells,
    below: &LevelBillboards,
    frame: &CameraFrame,
    texels: u32,
) -> LevelBillboards {
    let t2 = (texels * texels) as usize;
    let [right, up, back] = frame.axes();
    let size = frame.half_size(1.0);
    let factor = lattice.branching.factor();
    let mut out =
        LevelBillboards { hidden: parents_hidden(cells, &below.hidden), ..Default::default() };
    let mut next = 0;
    for (i, &(first, mask)) in (0..).zip(&cells.children) {
        let mut children = Vec::new();
        let there = (0..lattice.branching.children()).filter(|n| mask >> n & 1 == 1);
        for (cell, number) in (first..).zip(there) {
            // Both lists ascend.
            while next < below.cells.len() && below.cells[next] < cell {
                next += 1;
            }
            if below.cells.get(next) == Some(&cell) {
                let place = lattice.branching.place(number).as_dvec3() + 0.5;
                let off: DVec3 = place / f64::from(factor) - 0.5;
                children.push(Child {
                    at: [off.dot(right), off.dot(up)],
                    back: off.dot(back),
                    texels: &below.texels[next * t2..][..t2],
                });
            }
        }
        if children.is_empty() {
            continue;
        }
        children.sort_by(|a, b| b.back.total_cmp(&a.back));
        out.cells.push(i);
        for texel in 0..texels * texels {
            out.texels.push(mean(&children, size, texels, factor, texel));
        }
    }
    out
}

/// A cell is hidden if all that it holds is.
fn parents_hidden(cells: &Cells, below: &[bool]) -> Vec<bool> {
    let of = |&(first, mask): &(u32, u32)| {
        below[first as usize..][..mask.count_ones() as usize].iter().all(|h| *h)
    };
    cells.children.iter().map(of).collect()
}

/// One texel: the mean over it of its children, front to back.
fn mean(children: &[Child], size: [f64; 2], texels: u32, factor: u32, texel: u32) -> [u8; 4] {
    let mut sum = [0.0f32; 4];
    let n = f64::from(texels);
    let fine = |i: u32, s: u32| (f64::from(i) + (f64::from(s) + 0.5) / f64::from(SAMPLES)) / n;
    for sample in 0..SAMPLES * SAMPLES {
        let x = (2.0 * fine(texel % texels, sample % SAMPLES) - 1.0) * size[0];
        let y = (1.0 - 2.0 * fine(texel / texels, sample / SAMPLES)) * size[1];
        let mut through = 1.0;
        for child in children {
            let place = |off: f64, size: f64| 0.5 * n * (1.0 + off * f64::from(factor) / size);
            let (u, v) = (place(x - child.at[0], size[0]), place(child.at[1] - y, size[1]));
            if u < 0.0 || v < 0.0 || u >= n || v >= n {
                continue;
            }
            let [r, g, b, a] = child.texels[(v as u32 * texels + u as u32) as usize];
            let alpha = f32::from(a) / 255.0;
            for (to, c) in sum.iter_mut().zip([r, g, b]) {
                *to += through * alpha * srgb8_to_linear(c);
            }
            sum[3] += through * alpha;
            through *= 1.0 - alpha;
        }
    }
    let scale = if sum[3] > 0.0 { 1.0 / sum[3] } else { 0.0 };
    let [r, g, b] = [0, 1, 2].map(|k| linear_to_srgb8(sum[k] * scale));
    [r, g, b, (sum[3] / (SAMPLES * SAMPLES) as f32 * 255.0).round() as u8]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cells::{Opacity, cells};
    use crate::lattice::Branching;
    use forest_soup::{Camera, PhotoCamera, Projection};

    #[test]
    fn a_parent_shows_its_front_children_over_the_back_ones() {
        let branching = Branching::Octree;
        let lattice = Lattice { corner: DVec3::ZERO, side: 1.0, branching, levels: 1 };
        let levels = cells(&lattice, &Opacity::from_finest(&lattice, vec![1.0; 8]));
        let projection = Projection::Orthographic { height: 1.0 };
        let camera = Camera::new(DVec3::splat(0.5), -DVec3::Z, projection, [8, 8]);
        let far = PhotoCamera { eye: DVec3::Z * 9.0, ..PhotoCamera::from(&camera) };
        let frame = CameraFrame::of(&far, DVec3::splat(0.5), 1.0);
        // Children 4 … 7 are in front: half transparent red over opaque green; 4 is missing.
        let front = [255, 0, 0, 128];
        let below = LevelBillboards {
            cells: vec![0, 1, 2, 3, 5, 6, 7],
            texels: [vec![[0, 255, 0, 255]; 4 * 4], vec![front; 3 * 4]].concat(),
            hidden: vec![true, false, false, false, false, false, false, false],
        };
        let root = average(&lattice, &levels[0], &below, &frame, 2);
        assert_eq!((root.cells, root.hidden), (vec![0], vec![false]));
        // Row 0 is the top, child 4 the lower left.
        let both = [188, 187, 0, 255];
        for (texel, want) in root.texels.iter().zip([both, both, [0, 255, 0, 255], both]) {
            for (a, b) in texel.iter().zip(want) {
                assert!(a.abs_diff(b) <= 1, "{:?}", root.texels);
            }
        }
    }
}
