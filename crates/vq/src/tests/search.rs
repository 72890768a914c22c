//! The nearest word is found, whatever the bounds say.

use super::{brute_force, clumps};
use crate::{Codebook, Vectors, assign};
use proptest::prelude::*;

#[test]
fn assignments_are_those_of_brute_force() {
    for (dimension, words) in [(1, 7), (3, 40), (7, 16), (8, 17), (16, 100), (48, 300), (50, 33)] {
        let vectors = clumps(1500, dimension, 1);
        let book = Codebook::new(dimension, clumps(words, dimension, 2).values().to_vec()).unwrap();
        assert_eq!(assign(&book, &vectors), brute_force(book.words(), &vectors), "{dimension}");
    }
}

#[test]
fn one_word_serves_all() {
    let vectors = clumps(10, 5, 1);
    let book = Codebook::new(5, vec![1e14; 5]).unwrap();
    assert_eq!(assign(&book, &vectors), [0; 10]);
    assert!(assign(&book, &Vectors::new(5, vec![]).unwrap()).is_empty());
}

#[test]
#[should_panic(expected = "words of dimension 5, vectors of dimension 4")]
fn dimensions_must_agree() {
    assign(&Codebook::new(5, vec![0.0; 5]).unwrap(), &clumps(3, 4, 1));
}

proptest! {
    /// Few values, so that distances are often equal; far from 0 or huge, so that bounds are as wrong
    /// as they can be.
    #[test]
    fn ties_and_rounding_do_not_mislead(
        dimension in 1usize..40,
        scale in prop::sample::select(vec![1e-20f32, 1.0, 0.1, 1e6, 1e8]),
        shift in prop::sample::select(vec![0.0f32, 1.0, 1000.0, -3e6]),
        numbers in prop::collection::vec(0u8..4, 400..2400),
        words in 1usize..60,
    ) {
        let value = |&v: &u8| (f32::from(v) + shift) * scale;
        let rows = numbers.len() / dimension;
        let values = numbers[..rows * dimension].iter().map(value).collect();
        let vectors = Vectors::new(dimension, values).unwrap();
        let words: Vec<f32> = (0..words).flat_map(|w| vectors.row(w * 7 % rows).to_vec()).collect();
        let book = Codebook::new(dimension, words).unwrap();
        prop_assert_eq!(assign(&book, &vectors), brute_force(book.words(), &vectors));
    }

    /// Distances over many orders of magnitude.
    #[test]
    fn outliers_do_not_mislead(
        exponents in prop::collection::vec(-12f32..12.0, 640),
        signs in prop::collection::vec(any::<bool>(), 640),
    ) {
        let value = |(e, s): (&f32, &bool)| if *s { 10f32.powf(*e) } else { -(10f32.powf(*e)) };
        let values: Vec<f32> = exponents.iter().zip(&signs).map(value).collect();
        let vectors = Vectors::new(10, values.clone()).unwrap();
        let book = Codebook::new(10, values[..300].to_vec()).unwrap();
        prop_assert_eq!(assign(&book, &vectors), brute_force(book.words(), &vectors));
    }
}
