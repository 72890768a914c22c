//! What every training keeps to.

use super::{brute_force, clumps};
use crate::{Centers, Seeding, TrainOptions, Training, Vectors, VqError, train};
use proptest::prelude::*;

const ALL: [(Centers, Seeding); 4] = [
    (Centers::Mean, Seeding::PlusPlus),
    (Centers::Nearest, Seeding::PlusPlus),
    (Centers::Mean, Seeding::Random),
    (Centers::Nearest, Seeding::Random),
];

fn options(codewords: usize, (centers, seeding): (Centers, Seeding)) -> TrainOptions {
    TrainOptions { codewords, centers, seeding, ..TrainOptions::default() }
}

/// Weighted mean of the squared distances, in f64.
fn distortion(vectors: &Vectors, weights: Option<&[f32]>, t: &Training) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for (i, &index) in t.indices.iter().enumerate() {
        let weight = weights.map_or(1.0, |w| f64::from(w[i]));
        let word = t.codebook.word(index as usize);
        let squares =
            vectors.row(i).iter().zip(word).map(|(a, b)| (f64::from(*a) - f64::from(*b)).powi(2));
        sum += weight * squares.sum::<f64>();
        total += weight;
    }
    sum / total
}

fn check(vectors: &Vectors, weights: Option<&[f32]>, centers: Centers, t: &Training) {
    assert_eq!(t.indices, brute_force(t.codebook.words(), vectors));
    let want = distortion(vectors, weights, t);
    assert!((t.distortion - want).abs() <= 1e-9 * want, "{} for {want}", t.distortion);
    match centers {
        Centers::Mean => {
            assert!(t.history.is_sorted_by(|a, b| a >= b), "{:?}", t.history);
            assert_eq!(t.history.last(), Some(&t.distortion));
        }
        Centers::Nearest => {
            assert!(t.history.contains(&t.distortion));
            let rows: Vec<&[f32]> = (0..vectors.len()).map(|i| vectors.row(i)).collect();
            for w in 0..t.codebook.len() {
                assert!(rows.contains(&t.codebook.word(w)), "word {w} is no vector");
            }
        }
    }
}

#[test]
fn all_kinds_keep_the_rules() {
    // With samples (4000 rows for 20 words) and without.
    for (count, dimension, codewords) in [(4000, 48, 20), (700, 16, 100), (400, 3, 1)] {
        let vectors = clumps(count, dimension, 3);
        let weights: Vec<f32> = (0..count).map(|i| (i % 5) as f32).collect();
        for kind in ALL {
            for weights in [None, Some(&weights[..])] {
                let t = train(&vectors, weights, &options(codewords, kind)).unwrap();
                assert_eq!(t.codebook.len(), codewords);
                check(&vectors, weights, kind.0, &t);
                let full = count as u64 * codewords as u64 * t.history.len() as u64;
                assert!(codewords == 1 || t.distances < full, "{} of {full}", t.distances);
            }
        }
    }
}

#[test]
fn threads_change_nothing() {
    let vectors = clumps(20_000, 24, 4);
    for kind in ALL {
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| train(&vectors, None, &options(64, kind)).unwrap())
        };
        let one = with(1);
        assert_eq!(one, with(2));
        assert_eq!(one, with(8));
        let bits =
            |t: &Training| t.codebook.words().iter().map(|w| w.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&one), bits(&with(2)));
    }
}

#[test]
fn seeds_change_something() {
    let vectors = clumps(2000, 8, 5);
    let with = |seed| {
        let options = TrainOptions { seed, ..options(50, ALL[0]) };
        train(&vectors, None, &options).unwrap()
    };
    assert_eq!(with(7), with(7));
    assert_ne!(with(7).codebook, with(8).codebook);
}

#[test]
fn few_distinct_vectors_are_their_own_words() {
    let values: Vec<f32> = (0..300).flat_map(|i| [(i % 6) as f32, -0.0, 1e9]).collect();
    let vectors = Vectors::new(3, values).unwrap();
    for kind in ALL {
        for codewords in [6, 7, 1000] {
            let t = train(&vectors, None, &options(codewords, kind)).unwrap();
            assert_eq!((t.codebook.len(), t.distortion), (6, 0.0));
            check(&vectors, None, kind.0, &t);
        }
        // Of the signs of 0 the first is kept, and makes no difference.
        let equal = Vectors::new(2, [[0.0, 1.0], [-0.0, 1.0]].concat()).unwrap();
        let t = train(&equal, None, &options(5, kind)).unwrap();
        assert_eq!((t.codebook.len(), &t.indices[..], t.distortion), (1, &[0, 0][..], 0.0));
    }
}

#[test]
fn weights_count_as_copies() {
    let vectors = clumps(600, 6, 6);
    let copies: Vec<usize> = (0..600).map(|i| 1 + i % 3).collect();
    let values = (0..600).flat_map(|i| vectors.row(i).repeat(copies[i])).collect();
    let many = Vectors::new(6, values).unwrap();
    let weights: Vec<f32> = copies.iter().map(|c| *c as f32).collect();
    for kind in ALL {
        let a = train(&vectors, Some(&weights), &options(30, kind)).unwrap();
        let b = train(&many, None, &options(30, kind)).unwrap();
        assert_eq!((a.codebook, a.distortion), (b.codebook, b.distortion));
    }
}

#[test]
fn vectors_without_weight_have_no_say() {
    let vectors = clumps(500, 4, 7);
    let weights: Vec<f32> = (0..500).map(|i| if i < 3 { 2.0 } else { 0.0 }).collect();
    for kind in ALL {
        let t = train(&vectors, Some(&weights), &options(10, kind)).unwrap();
        assert_eq!((t.codebook.len(), t.distortion), (3, 0.0));
        check(&vectors, Some(&weights), kind.0, &t);
    }
}

/// Random words in a clump where few are needed leave others without rows.
#[test]
fn words_without_rows_move() {
    let mut values = vec![0.0; 0];
    values.extend((0..4000).map(|i| (i % 50) as f32 * 1e-6));
    values.extend((0..50).map(|i| 1000.0 + 50.0 * i as f32));
    let vectors = Vectors::new(1, values).unwrap();
    for kind in ALL {
        let t = train(&vectors, None, &options(60, kind)).unwrap();
        check(&vectors, None, kind.0, &t);
        let mut used = vec![false; t.codebook.len()];
        t.indices.iter().for_each(|i| used[*i as usize] = true);
        assert!(used.iter().all(|u| *u), "{kind:?}");
        // A word for each of the far ones, the rest for the clump.
        let far = kind.1 == Seeding::PlusPlus;
        assert!(!far || t.distortion < 1e-6, "{kind:?}: {}", t.distortion);
    }
}

#[test]
fn nonsense_is_refused() {
    let vectors = clumps(4, 2, 8);
    let refused = |weights: Option<&[f32]>, options: &TrainOptions| {
        train(&vectors, weights, options).unwrap_err()
    };
    let good = TrainOptions::default();
    assert_eq!(refused(Some(&[1.0; 3]), &good), VqError::WeightCount { expected: 4, got: 3 });
    let message = refused(Some(&[1.0, 1.0, -1.0, 1.0]), &good).to_string();
    assert_eq!(message, "weight 2 is -1; finite numbers from 0");
    assert!(matches!(refused(Some(&[f32::NAN; 4]), &good), VqError::Weight { row: 0, .. }));
    assert_eq!(refused(Some(&[0.0; 4]), &good), VqError::NoWeight(4));
    for bad in [
        TrainOptions { codewords: 0, ..good },
        TrainOptions { iterations: 0, ..good },
        TrainOptions { tolerance: f64::NAN, ..good },
        TrainOptions { tolerance: 1.0, ..good },
    ] {
        assert!(matches!(refused(None, &bad), VqError::Option { .. }), "{bad:?}");
    }
    let none = Vectors::new(2, vec![]).unwrap();
    assert_eq!(train(&none, None, &good), Err(VqError::Empty));
}

proptest! {
    #[test]
    fn any_vectors_keep_the_rules(
        dimension in 1usize..20,
        numbers in prop::collection::vec(-20i8..20, 20..800),
        scale in prop::sample::select(vec![1.0f32, 0.3, 1e-15, 1e12]),
        codewords in 1usize..30,
        iterations in 1u32..8,
        kind in prop::sample::select(ALL.to_vec()),
        seed in any::<u64>(),
    ) {
        let rows = numbers.len() / dimension;
        let values = numbers[..rows * dimension].iter().map(|v| f32::from(*v) * scale).collect();
        let vectors = Vectors::new(dimension, values).unwrap();
        let options = TrainOptions { iterations, seed, ..options(codewords, kind) };
        let t = train(&vectors, None, &options).unwrap();
        check(&vectors, None, kind.0, &t);
        prop_assert!(t.codebook.len() <= codewords);
        prop_assert!(t.history.len() <= iterations as usize);
    }
}
