//! Vector quantisation: a few words that stand for many small vectors.
//!
//! What billboards of 4 × 4 texels are stored as: section 4.1 of C. Linz, A. Reche-Martinez,
//! G. Drettakis, M. Magnor, "Effective multi-resolution rendering and texture compression for
//! captured volumetric trees", Eurographics Workshop on Natural Phenomena (2006), paper 004: blocks
//! of 16 colours as 48 numbers in CIELab ([`linear_to_lab`]), blocks of 16 alphas as 16, each coded by
//! the number of the nearest of a few hundred words ([`train`], [`pack_bits`]). Where we deviate:
//!
//! * words start from careful seeding and from rounds over samples, not from random vectors: a few
//!   rounds over all vectors are left;
//! * nearest words are found exactly, but few distances are computed: sketches of eight numbers rule
//!   out all but one or two words of 512 (after the idea of C. Elkan, "Using the triangle inequality
//!   to accelerate k-means", ICML 2003, of bounding distances from below);
//! * words become original vectors ([`Centers::Nearest`]) only after rounds of means, which lowers
//!   the distortion by 3 % beside doing so from the first round;
//! * results are the same on any machine, with any number of threads.
//!
//! ```
//! use forest_vq::{Centers, TrainOptions, Vectors, bits_for, pack_bits, read_bits, train};
//!
//! // Twelve numbers in three clumps.
//! let values = [0.0, 0.1, 0.2, 5.0, 5.1, 5.2, 9.0, 9.1, 9.2, 0.1, 5.1, 9.1];
//! let vectors = Vectors::new(1, values.to_vec()).unwrap();
//! let options = TrainOptions { codewords: 3, centers: Centers::Nearest, ..TrainOptions::default() };
//! let training = train(&vectors, None, &options).unwrap();
//!
//! let mut words = training.codebook.words().to_vec();
//! words.sort_by(f32::total_cmp);
//! assert_eq!(words, [0.1, 5.1, 9.1]);
//! let bits = bits_for(training.codebook.len());
//! let stored = pack_bits(&training.indices, bits);
//! assert_eq!((bits, stored.len()), (2, 4));
//! let word = training.codebook.word(read_bits(&stored, bits, 4) as usize);
//! assert!((word[0] - values[4]).abs() < 0.11);
//! ```

mod assign;
mod bits;
mod codebook;
mod distance;
mod error;
mod lab;
mod lloyd;
mod options;
mod rows;
mod search;
mod seed;
mod sketch;
mod train;
mod vectors;
mod words;

#[cfg(test)]
mod tests;

pub use assign::assign;
pub use bits::{bits_for, pack_bits, read_bits};
pub use codebook::Codebook;
pub use error::VqError;
pub use lab::{lab_to_linear, linear_to_lab};
pub use options::{Centers, Seeding, TrainOptions};
pub use train::{Training, train};
pub use vectors::{MAX_VALUE, Vectors};
