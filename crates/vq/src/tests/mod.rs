//! Rules of trainings and searches, against brute force.

mod search;
mod training;

use crate::Vectors;
use crate::distance::{Lanes, pad, squared};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg32;

/// `count` vectors in clumps, with neighbouring elements alike: as blocks of texels are.
fn clumps(count: usize, dimension: usize, seed: u64) -> Vectors {
    let mut random = Pcg32::seed_from_u64(seed);
    let middles: Vec<[f32; 3]> =
        (0..40).map(|_| std::array::from_fn(|_| random.random::<f32>() * 100.0)).collect();
    let mut values = Vec::new();
    for _ in 0..count {
        let middle = middles[random.random_range(0..40u32) as usize];
        let shift = random.random::<f32>() * 8.0;
        values.extend((0..dimension).map(|j| middle[j % 3] + shift + random.random::<f32>() * 5.0));
    }
    Vectors::new(dimension, values).unwrap()
}

/// The nearest word of each vector, by all distances; the lowest of several.
fn brute_force(words: &[f32], vectors: &Vectors) -> Vec<u32> {
    let dimension = vectors.dimension();
    let words: Vec<Vec<Lanes>> = words.chunks_exact(dimension).map(|w| pad(w).collect()).collect();
    let nearest = |i| {
        let row: Vec<Lanes> = pad(vectors.row(i)).collect();
        let (mut index, mut least) = (0, f32::INFINITY);
        for (w, word) in (0..).zip(&words) {
            let distance = squared(pulp::Scalar::new(), &row, word);
            if distance < least {
                (index, least) = (w, distance);
            }
        }
        index
    };
    (0..vectors.len()).map(nearest).collect()
}
