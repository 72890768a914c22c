//! The nearest words of vectors.

use crate::codebook::Codebook;
use crate::distance::Lanes;
use crate::rows::Rows;
use crate::search::{NONE, Search};
use crate::sketch::Sketcher;
use crate::vectors::Vectors;
use crate::words::Words;
use rayon::prelude::*;

/// Vectors that a thread takes at once.
const CHUNK: usize = 1024;

/// The nearest word of each vector by squared distance in f32, exactly; the lowest of several.
///
/// # Panics
/// If the dimensions differ, or there are vectors but no words.
pub fn assign(codebook: &Codebook, vectors: &Vectors) -> Vec<u32> {
    let (dimension, other) = (codebook.dimension(), vectors.dimension());
    assert_eq!(dimension, other, "words of dimension {dimension}, vectors of dimension {other}");
    if vectors.is_empty() {
        return Vec::new();
    }
    assert!(!codebook.is_empty(), "no words");
    let rows = |v: &Vectors| Rows::gather(v, &(0..v.len() as u32).collect::<Vec<_>>());
    let words = rows(codebook.vectors());
    let sketcher = Sketcher::new(&words, words.len());
    let words = Words::new(words.width, words.values, &sketcher);
    nearest(&words, &rows(vectors).values, &sketcher)
}

/// The nearest words of padded vectors.
pub(crate) fn nearest(words: &Words, rows: &[Lanes], sketcher: &Sketcher) -> Vec<u32> {
    let sketches = sketcher.sketches(rows);
    let mut indices = vec![NONE; sketches.len()];
    let mut distances = vec![0.0; sketches.len()];
    indices
        .par_chunks_mut(CHUNK)
        .zip(distances.par_chunks_mut(CHUNK))
        .zip(rows.par_chunks(CHUNK * words.width))
        .zip(sketches.par_chunks(CHUNK))
        .for_each(|(((indices, distances), rows), sketches)| {
            pulp::Arch::new().dispatch(Search { words, rows, sketches, indices, distances });
        });
    indices
}
