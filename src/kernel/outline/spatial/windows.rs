//! Many sections of one direction, a few at a time: windows of neighbouring sections that overlap, and the weights at
//! which what is fitted to each of them is blended (a partition of unity along the normal; Wendland 2002).

use std::ops::Range;

/// A window of sections, and where along the normal what is fitted to it counts.
#[derive(Clone, Debug, PartialEq)]
pub struct Window {
    /// The sections.
    pub sections: Range<usize>,
    /// Its weight rises from 0 to 1 over the first range of offsets and falls over the last one; none at an end.
    rises: Option<[f64; 2]>,
    falls: Option<[f64; 2]>,
}

/// Sections that neighbouring windows share: over those one fades into the other.
const SHARED: usize = 2;

/// Windows of at most `most` sections (but two more than are shared, at least) with these offsets, in order.
#[must_use]
pub fn windows(offsets: &[f64], most: usize) -> Vec<Window> {
    let (count, most) = (offsets.len(), most.max(SHARED + 2));
    if count <= most {
        return vec![Window { sections: 0..count, rises: None, falls: None }];
    }
    let number = (count - SHARED).div_ceil(most - SHARED);
    // Spread evenly, so that the last is no smaller than the others.
    let start = |n: usize| n * (count - SHARED) / number;
    let shared = |n: usize| [offsets[start(n)], offsets[start(n) + SHARED - 1]];
    let window = |n: usize| Window {
        sections: start(n)..start(n + 1) + SHARED,
        rises: (n > 0).then(|| shared(n)),
        falls: (n + 1 < number).then(|| shared(n + 1)),
    };
    (0..number).map(window).collect()
}

impl Window {
    /// How much the window counts at an offset; those of all windows sum to 1.
    #[must_use]
    pub fn weight(&self, offset: f64) -> f64 {
        let share = |[low, high]: [f64; 2]| smooth(((offset - low) / (high - low)).clamp(0.0, 1.0));
        self.rises.map_or(1.0, share) * (1.0 - self.falls.map_or(0.0, share))
    }
}

fn smooth(t: f64) -> f64 {
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_sum_to_one_and_each_section_has_a_window() {
        for (count, most) in [(3, 9), (10, 5), (11, 5), (50, 8), (7, 1), (100, 30)] {
            let offsets: Vec<f64> = (0..count).map(|n| 1.5 * f64::from(n) + 0.01 * f64::from(n * n)).collect();
            let found = windows(&offsets, most);
            assert!((0..offsets.len()).all(|n| found.iter().any(|w| w.sections.contains(&n))), "{count} {most}");
            assert!(found.iter().all(|w| w.sections.len() <= most.max(4)));
            for n in -5..200 {
                let at = f64::from(n) * 0.83;
                let weights: Vec<f64> = found.iter().map(|w| w.weight(at)).collect();
                assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{at}: {weights:?}");
                assert!(weights.iter().filter(|w| **w > 0.0).count() <= 2);
            }
        }
    }
}
