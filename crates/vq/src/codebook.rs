//! The words that stand for vectors.

use crate::error::VqError;
use crate::vectors::Vectors;

/// Words: vectors that stand for others.
#[derive(Clone, Debug, PartialEq)]
pub struct Codebook {
    words: Vectors,
}

impl Codebook {
    /// `words` holds the words one after the other, `dimension` numbers each.
    ///
    /// # Errors
    /// As [`Vectors::new`].
    pub fn new(dimension: usize, words: Vec<f32>) -> Result<Self, VqError> {
        Ok(Self { words: Vectors::new(dimension, words)? })
    }

    /// Numbers in a word, ≥ 1.
    pub fn dimension(&self) -> usize {
        self.words.dimension()
    }

    /// Words.
    pub fn len(&self) -> usize {
        self.words.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.words.is_empty()
    }

    /// Word `i`: `dimension` numbers.
    ///
    /// # Panics
    /// If there is no such word.
    pub fn word(&self, i: usize) -> &[f32] {
        self.words.row(i)
    }

    pub(crate) fn vectors(&self) -> &Vectors {
        &self.words
    }

    /// All of them, one after the other.
    pub fn words(&self) -> &[f32] {
        self.words.values()
    }
}
