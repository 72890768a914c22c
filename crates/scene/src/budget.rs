//! The best packs for so many bytes: which of each species' candidates to take.

/// A way to prune a species' pack.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// Bytes of it.
    pub bytes: u64,
    /// What it adds to the expected error of the scene's pictures.
    pub error: f64,
}

/// One candidate of each species.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// Bytes of all of them.
    pub bytes: u64,
    /// Their errors' sum.
    pub error: f64,
    /// The index of each.
    pub picks: Vec<usize>,
}

/// More choices than this are thinned out, evenly: the ends stay.
const MOST: usize = 1 << 14;

/// All choices that no other is better than in both bytes and error, the smallest first. Exact while there
/// are no more than 16,384 of them after any species: choices of the species so far that another one beats
/// stay beaten, whatever is added to both.
pub fn frontier(species: &[Vec<Candidate>]) -> Vec<Choice> {
    let mut front = vec![Choice { bytes: 0, error: 0.0, picks: Vec::new() }];
    for candidates in species {
        let mut all = Vec::with_capacity(front.len() * candidates.len());
        for choice in &front {
            for (i, c) in candidates.iter().enumerate() {
                let mut picks = choice.picks.clone();
                picks.push(i);
                let (bytes, error) = (choice.bytes + c.bytes, choice.error + c.error);
                all.push(Choice { bytes, error, picks });
            }
        }
        front = unbeaten(all);
    }
    front
}

fn unbeaten(mut all: Vec<Choice>) -> Vec<Choice> {
    all.sort_by(|a, b| a.bytes.cmp(&b.bytes).then(a.error.total_cmp(&b.error)));
    let mut least = f64::INFINITY;
    all.retain(|c| {
        let better = c.error < least;
        least = least.min(c.error);
        better
    });
    if all.len() > MOST {
        let last = all.len() - 1;
        return (0..MOST).map(|k| all[k * last / (MOST - 1)].clone()).collect();
    }
    all
}

/// The choice of a frontier with the least error within so many bytes.
pub fn within_bytes(front: &[Choice], most: u64) -> Option<&Choice> {
    front[..front.partition_point(|c| c.bytes <= most)].last()
}

/// The smallest choice of a frontier with no larger error.
pub fn within_error(front: &[Choice], most: f64) -> Option<&Choice> {
    front.get(front.partition_point(|c| c.error > most))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// All ways to take one of each.
    fn every(species: &[Vec<Candidate>]) -> Vec<(u64, f64)> {
        species.iter().fold(vec![(0, 0.0)], |sums, of| {
            sums.iter()
                .flat_map(|(b, e)| of.iter().map(move |c| (b + c.bytes, e + c.error)))
                .collect()
        })
    }

    proptest! {
        #[test]
        fn no_way_to_choose_is_better(
            species in prop::collection::vec(
                prop::collection::vec((1u64..50, 0u32..50), 1..7),
                1..5,
            ),
            most in 1u64..200,
        ) {
            let candidate = |(bytes, error): &(u64, u32)| Candidate { bytes: *bytes, error: f64::from(*error) };
            let species: Vec<Vec<Candidate>> =
                species.iter().map(|s| s.iter().map(candidate).collect()).collect();
            let front = frontier(&species);
            let all = every(&species);
            let best = all.iter().filter(|a| a.0 <= most).map(|a| a.1).min_by(f64::total_cmp);
            prop_assert_eq!(within_bytes(&front, most).map(|c| c.error), best);
            let error = most as f64 * 0.5;
            let least = all.iter().filter(|a| a.1 <= error).map(|a| a.0).min();
            prop_assert_eq!(within_error(&front, error).map(|c| c.bytes), least);
            for c in &front {
                let sum = c.picks.iter().zip(&species).fold((0, 0.0), |(b, e), (i, s)| (b + s[*i].bytes, e + s[*i].error));
                prop_assert_eq!((c.bytes, c.error), sum);
            }
        }
    }

    #[test]
    fn a_long_frontier_keeps_its_ends() {
        // 200 × 200 choices, none of which beats another.
        let one: Vec<Candidate> =
            (0..200u64).map(|k| Candidate { bytes: k, error: (200 - k) as f64 }).collect();
        let two: Vec<Candidate> = (0..200u64)
            .map(|k| Candidate { bytes: 1000 * k, error: (200 - k) as f64 * 1000.0 })
            .collect();
        let front = frontier(&[one, two]);
        assert_eq!(front.len(), MOST);
        assert_eq!((front[0].bytes, front[MOST - 1].bytes), (0, 199_199));
    }
}
