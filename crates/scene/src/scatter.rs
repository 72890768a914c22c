//! Where trees stand (paper 001, section 3.2).

use crate::heightmap::Grey;
use crate::instances::{Instance, MOST_SPECIES};
use crate::land::Land;
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, Poisson};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

/// How trees are scattered.
#[derive(Clone, Debug, PartialEq)]
pub struct Scatter {
    /// Side of a square in metres: any, also one that the land is no multiple of.
    pub square: f64,
    /// Mean number of trees in a square where the density is 1.
    pub mean: f64,
    /// Share of the largest perturbation that keeps a tree within its square, in 0 … 1.
    pub jitter: f64,
    /// Weight of each species, not negative; at least one above 0.
    pub weights: Vec<f64>,
    /// The same seed plants the same trees on every machine.
    pub seed: u64,
}

/// Most trees in a square.
const MOST_IN_SQUARE: f64 = 4096.0;

/// Most squares along a side.
const MOST_SQUARES: f64 = 65536.0;

/// Most trees of a scene.
pub const MOST_TREES: usize = 1 << 26;

impl Scatter {
    /// Checks the rules above against a land.
    ///
    /// # Errors
    /// The first broken rule, with the value and the limit.
    pub fn validate(&self, land: &Land) -> Result<(), String> {
        let longest = land.size[0].max(land.size[1]);
        if !(self.square > 0.0 && longest / self.square <= MOST_SQUARES) {
            let text = "it must be above 0, and the land at most 65536 squares wide";
            return Err(format!("a square of {} m: {text}", self.square));
        }
        if !(0.0..=MOST_IN_SQUARE).contains(&self.mean) {
            let mean = self.mean;
            return Err(format!("{mean} trees a square; it must be within 0 and {MOST_IN_SQUARE}"));
        }
        if !(0.0..=1.0).contains(&self.jitter) {
            return Err(format!("a jitter of {}; it must be within 0 and 1", self.jitter));
        }
        let all: f64 = self.weights.iter().sum();
        if !(1..=MOST_SPECIES).contains(&self.weights.len())
            || self.weights.iter().any(|w| !(0.0..=1e9).contains(w))
            || all <= 0.0
        {
            let text = "they must be not negative and not all 0";
            return Err(format!("weights {:?}: {text}", self.weights));
        }
        let [x, z] = self.squares(land).map(|n| n as f64);
        let expected = x * z * self.mean;
        if expected > MOST_TREES as f64 {
            return Err(format!("{expected:.0} trees are expected; the limit is {MOST_TREES}"));
        }
        Ok(())
    }

    /// Squares along x and z; the last ones may reach over the border.
    fn squares(&self, land: &Land) -> [u64; 2] {
        land.size.map(|s| ((s / self.square).ceil() as u64).max(1))
    }

    /// The mean of trees a square that makes `trees` of them expected on `land`.
    pub fn mean_for(trees: f64, square: f64, land: &Land, density: Option<&Grey>) -> f64 {
        let share = density.map_or(1.0, |d| {
            let all: f64 = d.values.iter().map(|v| f64::from(v.clamp(0.0, 1.0))).sum();
            all / d.values.len() as f64
        });
        trees * square * square / (land.size[0] * land.size[1] * share.max(1e-9))
    }

    /// Plants trees: in each square a Poisson number of them, in the set pattern of that number, moved
    /// by up to half a square over the number, on the ground, turned and scaled at random. Where
    /// `density` (over the whole land) is below 1 there are as many fewer.
    pub fn plant(&self, land: &Land, density: Option<&Grey>) -> Vec<Instance> {
        let [nx, nz] = self.squares(land);
        let row = |j: u64| (0..nx).flat_map(move |i| self.square(land, density, [i, j]));
        (0..nz).into_par_iter().flat_map_iter(row).collect()
    }

    fn square(&self, land: &Land, density: Option<&Grey>, [i, j]: [u64; 2]) -> Vec<Instance> {
        // Each square has its own numbers: no result depends on the order of squares.
        let mut random = Pcg64Mcg::seed_from_u64(mix(mix(mix(self.seed) ^ i) ^ j));
        let corner = [i, j].map(|n| n as f64 * self.square);
        let half = self.square * 0.5;
        let here = density.map_or(1.0, |d| {
            let [u, v] = std::array::from_fn(|k| (corner[k] + half) / land.size[k]);
            f64::from(d.sample(u, v).clamp(0.0, 1.0))
        });
        let count = match Poisson::new(self.mean * here) {
            Ok(poisson) => poisson.sample(&mut random).min(2.0 * MOST_IN_SQUARE) as usize,
            // A mean of 0.
            Err(_) => 0,
        };
        let mut trees = Vec::with_capacity(count);
        for [u, v] in pattern(count) {
            let most = 0.5 * self.jitter / count as f64;
            let [u, v] = [u, v].map(|t| t + most * (2.0 * random.random::<f64>() - 1.0));
            let at = [corner[0] + u * self.square, corner[1] + v * self.square];
            let species = self.species(random.random());
            let (yaw, scale) = (random.random::<u16>(), random.random::<u16>());
            if at[0] <= land.size[0] && at[1] <= land.size[1] {
                let [x, z] = std::array::from_fn(|k| (at[k] - 0.5 * land.size[k]) as f32);
                // On the ground where the rounded position is.
                let y = land.height(f64::from(x), f64::from(z)) as f32;
                trees.push(Instance::new([x, y, z], species, yaw, scale));
            }
        }
        trees
    }

    /// The species that number `t` in 0 … 1 falls on.
    fn species(&self, t: f64) -> u8 {
        let mut left = t * self.weights.iter().sum::<f64>();
        let last = self.weights.iter().rposition(|w| *w > 0.0).unwrap_or(0);
        for (i, w) in self.weights.iter().enumerate() {
            if left < *w {
                return i as u8;
            }
            left -= w;
        }
        last as u8
    }
}

/// The set pattern of `count` places in the unit square: about √count rows, each with its share of
/// places at equal distances. No place is nearer than 1/(2·count) to the square's border.
fn pattern(count: usize) -> impl Iterator<Item = [f64; 2]> {
    let rows = ((count as f64).sqrt().round() as usize).max(1);
    (0..rows).flat_map(move |r| {
        let here = count * (r + 1) / rows - count * r / rows;
        (0..here).map(move |c| [(c as f64 + 0.5) / here as f64, (r as f64 + 0.5) / rows as f64])
    })
}

/// Spreads the bits of a number (the finalizer of splitmix64).
fn mix(v: u64) -> u64 {
    let v = v.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let v = (v ^ (v >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let v = (v ^ (v >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    v ^ (v >> 31)
}

#[cfg(test)]
mod tests;
