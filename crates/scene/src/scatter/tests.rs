use super::*;
use crate::fractal::{Fractal, diamond_square};
use proptest::prelude::*;

fn hills() -> Land {
    diamond_square(&Fractal { cells: 64, range: 30.0, smoothness: 0.8 }, 1000.0, 9)
}

fn scatter(square: f64, mean: f64) -> Scatter {
    Scatter { square, mean, jitter: 1.0, weights: vec![1.0], seed: 4 }
}

/// Trees in each whole square.
fn counts(scatter: &Scatter, land: &Land, trees: &[Instance]) -> Vec<u32> {
    let n = (land.size[0] / scatter.square).floor() as usize;
    let mut counts = vec![0; n * n];
    for t in trees {
        let square = |v: f32| ((f64::from(v) + 500.0) / scatter.square) as usize;
        let (i, j) = (square(t.position[0]), square(t.position[2]));
        if i < n && j < n {
            counts[j * n + i] += 1;
        }
    }
    counts
}

#[test]
fn every_square_is_covered() {
    // Figure 3a of the paper: half of the squares were empty. With 20 expected, none is.
    let (land, s) = (hills(), scatter(50.0, 20.0));
    let counts = counts(&s, &land, &s.plant(&land, None));
    assert_eq!(counts.len(), 400);
    assert!(counts.iter().all(|c| *c > 0), "{counts:?}");
}

#[test]
fn numbers_are_poissons() {
    let (land, s) = (hills(), scatter(10.0, 1.5));
    let counts = counts(&s, &land, &s.plant(&land, None));
    let n = counts.len() as f64;
    let mean = counts.iter().map(|c| f64::from(*c)).sum::<f64>() / n;
    let variance = counts.iter().map(|c| (f64::from(*c) - mean).powi(2)).sum::<f64>() / n;
    // Of 10,000 squares: standard error 0.012 of the mean, 0.025 of the variance.
    assert!((mean - 1.5).abs() < 0.05, "{mean}");
    assert!((variance - 1.5).abs() < 0.1, "{variance}");
    let empty = counts.iter().filter(|c| **c == 0).count() as f64 / n;
    assert!((empty - (-1.5f64).exp()).abs() < 0.02, "{empty}");
}

#[test]
fn no_tree_floats_or_sinks() {
    let land = hills();
    for t in scatter(7.0, 2.0).plant(&land, None) {
        let [x, y, z] = t.position.map(f64::from);
        assert_eq!(y as f32, land.height(x, z) as f32);
    }
}

#[test]
fn squares_below_a_unit_keep_their_scale() {
    // Figure 2b of the paper: positions ignored the scale of squares below 1.
    let land = Land { points: [2, 2], size: [20.0, 20.0], heights: vec![0.0; 4] };
    let trees = scatter(0.25, 1.0).plant(&land, None);
    assert!((trees.len() as f64 - 6400.0).abs() < 400.0, "{}", trees.len());
    let far = |k: usize| trees.iter().map(|t| t.position[k]).fold(0.0, f32::max);
    assert!((9.5..=10.0).contains(&far(0)) && (9.5..=10.0).contains(&far(2)));
}

#[test]
fn density_thins() {
    let land = hills();
    let half = Grey { size: [2, 1], values: vec![0.0, 1.0] };
    let trees = scatter(10.0, 2.0).plant(&land, Some(&half));
    let west = trees.iter().filter(|t| t.position[0] < -250.0).count();
    assert_eq!(west, 0);
    // Half of 20,000, within five standard deviations.
    assert!((trees.len() as f64 - 10_000.0).abs() < 500.0, "{}", trees.len());
    let mean = Scatter::mean_for(10_000.0, 10.0, &land, Some(&half));
    assert!((mean - 2.0).abs() < 1e-9, "{mean}");
}

#[test]
fn species_come_by_their_weights() {
    let s = Scatter { weights: vec![3.0, 0.0, 1.0], ..scatter(10.0, 2.0) };
    let trees = s.plant(&hills(), None);
    let of = |k| trees.iter().filter(|t| t.species() == k).count() as f64 / trees.len() as f64;
    assert!((of(0) - 0.75).abs() < 0.02 && of(1) == 0.0, "{}", of(0));
}

#[test]
fn jitter_is_inverse_to_the_number() {
    for count in [1usize, 2, 3, 5, 9, 30] {
        let places: Vec<[f64; 2]> = pattern(count).collect();
        assert_eq!(places.len(), count);
        for [u, v] in places {
            let border = u.min(1.0 - u).min(v).min(1.0 - v);
            assert!(border >= 0.5 / count as f64 - 1e-12, "{count}: {u}, {v}");
        }
    }
}

proptest! {
    #[test]
    fn any_square_size_stays_on_the_land(square in 0.5f64..700.0, mean in 0.0f64..3.0, seed: u64) {
        let land = Land { points: [2, 2], size: [97.0, 97.0], heights: vec![1.0; 4] };
        let s = Scatter { square, mean, seed, ..scatter(1.0, 1.0) };
        prop_assert_eq!(s.validate(&land), Ok(()));
        let trees = s.plant(&land, None);
        for t in &trees {
            prop_assert!(t.position[0].abs() <= 48.5 && t.position[2].abs() <= 48.5);
        }
        prop_assert_eq!(trees, s.plant(&land, None));
    }
}
