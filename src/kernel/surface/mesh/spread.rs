//! How distances of points from a surface are spread: a histogram of bins of one width.

use serde::{Deserialize, Serialize};

/// Bins between 0 and the largest distance.
const BINS: usize = 24;

/// How many distances fall into each bin; bin `n` holds those from `n * width` up to `(n + 1) * width`, the last one its upper end
/// too.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// The width of a bin, a length.
    pub width: f64,
    /// Numbers of distances; together all that were given.
    pub counts: Vec<u64>,
}

impl Spread {
    /// Counts finite distances, none of them negative; none where there is none.
    pub fn of(distances: impl Iterator<Item = f64> + Clone) -> Option<Self> {
        let largest = distances.clone().fold(None, |most: Option<f64>, d| Some(most.map_or(d, |most| most.max(d))))?;
        let bins = if largest > 0.0 { BINS } else { 1 };
        let width = if largest > 0.0 { largest / BINS as f64 } else { 1.0 };
        let mut counts = vec![0; bins];
        for distance in distances {
            counts[((distance / width) as usize).min(bins - 1)] += 1;
        }
        Some(Self { width, counts })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn distances_fall_into_their_bins() {
        let spread = Spread::of([0.0, 0.4, 1.5, 24.0, 23.5].into_iter()).unwrap();
        assert_eq!((spread.width, spread.counts.len()), (1.0, 24));
        assert_eq!((spread.counts[0], spread.counts[1], spread.counts[23]), (2, 1, 2));
        assert_eq!(Spread::of([0.0; 3].into_iter()), Some(Spread { width: 1.0, counts: vec![3] }));
        assert_eq!(Spread::of(std::iter::empty()), None);
    }

    proptest! {
        #[test]
        fn every_distance_is_counted_once(distances in prop::collection::vec(0.0..1e9_f64, 1..200)) {
            let spread = Spread::of(distances.iter().copied()).unwrap();
            prop_assert_eq!(spread.counts.iter().sum::<u64>(), distances.len() as u64);
        }
    }
}
