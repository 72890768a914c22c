//! Diamond–square terrain (paper 001, section 3.1).

use crate::land::Land;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// How rough a fractal land is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fractal {
    /// Cells along a side: a power of two, up to 8192.
    pub cells: u32,
    /// The paper's x: the first offsets are drawn from (−x, x), in metres.
    pub range: f64,
    /// The paper's y: the range shrinks by 2^−y a step. Smooth from about 0.8 on.
    pub smoothness: f64,
}

impl Fractal {
    /// Checks the rules above.
    ///
    /// # Errors
    /// The first broken rule, with the value and the limit.
    pub fn validate(&self) -> Result<(), String> {
        let Self { cells, range, smoothness } = *self;
        if !cells.is_power_of_two() || cells > 8192 {
            return Err(format!("{cells} cells; it must be a power of two up to 8192"));
        }
        if !(0.0..=1e4).contains(&range) {
            return Err(format!("a range of {range} m; it must be within 0 and 10000"));
        }
        if !(0.0..=4.0).contains(&smoothness) {
            return Err(format!("a smoothness of {smoothness}; it must be within 0 and 4"));
        }
        Ok(())
    }
}

/// A land of `size` metres a side. It is seamless: its borders are equal, and squares at the border
/// look across it, so that copies lie side by side without a crease. The same seed gives the same
/// land on every machine.
pub fn diamond_square(fractal: &Fractal, size: f64, seed: u64) -> Land {
    let n = fractal.cells.max(1) as usize;
    let mut torus = vec![0.0f32; n * n];
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut range = fractal.range;
    let mut step = n;
    while step > 1 {
        let half = step / 2;
        let mut offset =
            || if range > 0.0 { random.random_range(-range..range) as f32 } else { 0.0 };
        // Middles of squares, then middles of the diamonds between them.
        for z in (half..n).step_by(step) {
            for x in (half..n).step_by(step) {
                torus[z * n + x] = mean(&torus, n, [x, z], half, DIAGONAL) + offset();
            }
        }
        for z in (0..n).step_by(half) {
            let first = if (z / half).is_multiple_of(2) { half } else { 0 };
            for x in (first..n).step_by(step) {
                torus[z * n + x] = mean(&torus, n, [x, z], half, STRAIGHT) + offset();
            }
        }
        range *= (-fractal.smoothness).exp2();
        step = half;
    }
    let side = n + 1;
    let heights = (0..side * side).map(|i| torus[(i / side % n) * n + i % side % n]).collect();
    Land { points: [side as u32; 2], size: [size; 2], heights }
}

const DIAGONAL: [[isize; 2]; 4] = [[-1, -1], [1, -1], [-1, 1], [1, 1]];
const STRAIGHT: [[isize; 2]; 4] = [[-1, 0], [1, 0], [0, -1], [0, 1]];

/// Mean of the four neighbours at distance `reach`, around the torus of side `n`.
fn mean(torus: &[f32], n: usize, at: [usize; 2], reach: usize, ways: [[isize; 2]; 4]) -> f32 {
    let along = |k: usize, way: isize| {
        (at[k] as isize + way * reach as isize).rem_euclid(n as isize) as usize
    };
    ways.iter().map(|w| torus[along(1, w[1]) * n + along(0, w[0])]).sum::<f32>() / 4.0
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRACTAL: Fractal = Fractal { cells: 64, range: 10.0, smoothness: 1.0 };

    /// Root mean square of differences between neighbours along x.
    fn roughness(land: &Land) -> f64 {
        let [nx, nz] = land.points;
        let step = |i, j| f64::from(land.at(i + 1, j) - land.at(i, j)).powi(2);
        let all: f64 = (0..nz).flat_map(|j| (0..nx - 1).map(move |i| step(i, j))).sum();
        (all / f64::from(nz * (nx - 1))).sqrt()
    }

    #[test]
    fn the_first_step_is_the_papers() {
        // One cell a side halves once: the middle is an offset alone, within (−x, x).
        let land = diamond_square(&Fractal { cells: 2, ..FRACTAL }, 1.0, 3);
        assert_eq!(land.heights.len(), 9);
        let [corner, middle] = [land.at(0, 0), land.at(1, 1)];
        assert_eq!(corner, 0.0);
        assert!(middle != 0.0 && middle.abs() < 10.0);
        // Middles of borders: the mean of two corners and, across the seam, the middle twice, and an
        // offset within the same range.
        assert!((land.at(1, 0) - 0.5 * middle).abs() < 10.0);
        assert!(land.at(1, 0) != land.at(0, 1));
    }

    #[test]
    fn offsets_shrink_by_two_to_the_minus_y() {
        // Of the last step alone, the offsets are x·2^(−y·(n−1)): without range, means of neighbours.
        for y in [0.5, 1.0] {
            let fractal = Fractal { smoothness: y, ..FRACTAL };
            let land = diamond_square(&fractal, 1.0, 5);
            let last = 10.0 * (-y * 5.0f64).exp2();
            let mut most = 0.0f64;
            for j in (1..64).step_by(2) {
                for i in (1..64).step_by(2) {
                    let corners = land.at(i - 1, j - 1)
                        + land.at(i + 1, j - 1)
                        + land.at(i - 1, j + 1)
                        + land.at(i + 1, j + 1);
                    most = most.max(f64::from(land.at(i, j) - corners / 4.0).abs());
                }
            }
            assert!(most < last * 1.0001 && most > 0.98 * last, "{y}: {most} of {last}");
        }
    }

    #[test]
    fn a_smaller_y_is_rougher_and_a_larger_x_is_higher() {
        let of =
            |range, smoothness| diamond_square(&Fractal { range, smoothness, ..FRACTAL }, 1.0, 7);
        assert!(roughness(&of(10.0, 0.5)) > 2.0 * roughness(&of(10.0, 1.0)));
        let span = |l: &Land| l.range()[1] - l.range()[0];
        assert!((span(&of(20.0, 1.0)) - 2.0 * span(&of(10.0, 1.0))).abs() < 1e-3);
    }

    #[test]
    fn copies_lie_side_by_side_without_a_crease() {
        let land = diamond_square(&FRACTAL, 1.0, 11);
        let across =
            |f: &dyn Fn(u32) -> f64| ((0..64).map(|j| f(j).powi(2)).sum::<f64>() / 64.0).sqrt();
        for j in 0..=64 {
            assert_eq!(land.at(0, j), land.at(64, j));
            assert_eq!(land.at(j, 0), land.at(j, 64));
        }
        // The second difference across the seam is like that elsewhere.
        let bend = |i: u32, before: u32, after: u32| {
            across(&|j| {
                f64::from(land.at(before, j)) - 2.0 * f64::from(land.at(i, j))
                    + f64::from(land.at(after, j))
            })
        };
        let seam = bend(0, 63, 1);
        let inside: Vec<f64> = (2..62).step_by(2).map(|i| bend(i, i - 1, i + 1)).collect();
        let most = inside.iter().copied().fold(0.0, f64::max);
        assert!(seam < 1.2 * most, "{seam} against {most}");
    }

    #[test]
    fn the_seed_decides() {
        let of = |seed| diamond_square(&FRACTAL, 1.0, seed);
        assert_eq!(of(1), of(1));
        assert_ne!(of(1), of(2));
        let flat = diamond_square(&Fractal { range: 0.0, ..FRACTAL }, 1.0, 1);
        assert!(flat.heights.iter().all(|h| *h == 0.0));
    }
}
