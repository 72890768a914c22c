//! The distinct vectors, shuffled: a sample of them is a prefix.

use crate::distance::{LANES, Lanes, pad};
use crate::vectors::Vectors;
use hashbrown::HashTable;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;
use rayon::prelude::*;

/// Padded vectors, one after the other.
pub(crate) struct Rows {
    /// Lanes of a row.
    pub(crate) width: usize,
    pub(crate) values: Vec<Lanes>,
}

impl Rows {
    /// The vectors `which` of `vectors`.
    pub(crate) fn gather(vectors: &Vectors, which: &[u32]) -> Self {
        let width = vectors.dimension().div_ceil(LANES);
        let mut values = vec![Lanes([0.0; LANES]); which.len() * width];
        values.par_chunks_mut(width).zip(which).with_min_len(1024).for_each(|(to, &i)| {
            to.iter_mut().zip(pad(vectors.row(i as usize))).for_each(|(to, lanes)| *to = lanes);
        });
        Self { width, values }
    }

    pub(crate) fn len(&self) -> usize {
        self.values.len() / self.width
    }

    #[inline(always)]
    pub(crate) fn row(&self, i: usize) -> &[Lanes] {
        &self.values[i * self.width..][..self.width]
    }
}

/// Distinct vectors and what they weigh.
pub(crate) struct Distinct {
    /// Those that weigh something come first, shuffled; then the others.
    pub(crate) rows: Rows,
    /// Of those that weigh something: the weights of all equal vectors together.
    pub(crate) weights: Vec<f64>,
    /// The row of each vector.
    pub(crate) row_of: Vec<u32>,
}

impl Distinct {
    /// Merges equal vectors; `weights` are sound.
    pub(crate) fn new(vectors: &Vectors, weights: Option<&[f32]>, seed: u64) -> Self {
        let hashes: Vec<u64> =
            vectors.values().par_chunks(vectors.dimension()).with_min_len(1024).map(hash).collect();
        let mut table: HashTable<u32> = HashTable::with_capacity(vectors.len());
        // First of its kind, and the weight of the kind.
        let mut kinds: Vec<(u32, f64)> = Vec::with_capacity(vectors.len());
        let mut kind_of = Vec::with_capacity(vectors.len());
        for (i, &h) in hashes.iter().enumerate() {
            let row = vectors.row(i);
            let same = |&k: &u32| {
                let first = kinds[k as usize].0 as usize;
                hashes[first] == h && vectors.row(first) == row
            };
            let hash_of = |&k: &u32| hashes[kinds[k as usize].0 as usize];
            let kind = *table.entry(h, same, hash_of).or_insert(kinds.len() as u32).get();
            if kind as usize == kinds.len() {
                kinds.push((i as u32, 0.0));
            }
            kinds[kind as usize].1 += weights.map_or(1.0, |w| f64::from(w[i]));
            kind_of.push(kind);
        }
        let (mut order, light): (Vec<u32>, Vec<u32>) =
            (0..kinds.len() as u32).partition(|&k| kinds[k as usize].1 > 0.0);
        let mut random = Pcg32::seed_from_u64(seed);
        for i in (1..order.len()).rev() {
            order.swap(i, random.random_range(0..=i as u32) as usize);
        }
        let weights = order.iter().map(|&k| kinds[k as usize].1).collect();
        order.extend(light);
        let mut row_of_kind = vec![0; kinds.len()];
        for (row, &k) in (0..).zip(&order) {
            row_of_kind[k as usize] = row;
        }
        for k in &mut order {
            *k = kinds[*k as usize].0;
        }
        kind_of.iter_mut().for_each(|k| *k = row_of_kind[*k as usize]);
        Self { rows: Rows::gather(vectors, &order), weights, row_of: kind_of }
    }

    /// Rows that weigh something.
    pub(crate) fn heavy(&self) -> usize {
        self.weights.len()
    }
}

/// Equal for equal vectors: −0 counts as 0.
fn hash(row: &[f32]) -> u64 {
    const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;
    let mut lanes = [1u64; 4];
    for (i, v) in row.iter().enumerate() {
        let lane = &mut lanes[i % 4];
        *lane = (lane.rotate_left(23) ^ u64::from((v + 0.0).to_bits())).wrapping_mul(FACTOR);
    }
    let all = lanes.iter().fold(0u64, |h, l| (h.rotate_left(29) ^ l).wrapping_mul(FACTOR));
    all ^ all >> 32
}
