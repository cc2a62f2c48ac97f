//! `Histogram`: how often grey values occur, exact to 1 part in 2^16 of the positive and negative number line, in
//! bounded memory; what percentiles are taken from (docs/algorithms.md, "Grey range and presmoothing").
//!
//! A value is counted under the upper bits of its f32 pattern, which are ordered as the numbers are. Integers up to 2^8
//! have bins of their own; counts add up the same in any order.

use serde::{Deserialize, Serialize};

use super::grey_range::GreyRange;
use crate::store::Element;

/// How often values occur.
#[derive(Clone, Debug)]
pub struct Histogram {
    bins: Vec<u64>,
    low: f64,
    high: f64,
}

/// Bins are named by this many upper bits of a value's pattern.
const BIN_BITS: u32 = 20;
/// Values whose bins are told in one go, by instructions that take several at once, before they are counted one by one.
const TOGETHER: usize = 512;

impl Default for Histogram {
    fn default() -> Self {
        Self { bins: vec![0; 1 << BIN_BITS], low: f64::INFINITY, high: f64::NEG_INFINITY }
    }
}

impl Histogram {
    /// Counts some values.
    ///
    /// # Errors
    /// With the place of the first value that is no finite number; some before it are counted.
    pub fn add<T: Element>(&mut self, values: &[T]) -> Result<(), usize> {
        let mut bins = [0; TOGETHER];
        for (n, some) in values.chunks(TOGETHER).enumerate() {
            if let Some(place) = some.iter().position(|value| !value.to_f64().is_finite()) {
                return Err(n * TOGETHER + place);
            }
            let [low, high] = extremes(some).map(Element::to_f64);
            (self.low, self.high) = (self.low.min(low), self.high.max(high));
            bins.iter_mut().zip(some).for_each(|(bin, value)| *bin = bin_of(value.to_f64()));
            for &bin in &bins[..some.len()] {
                self.bins[bin as usize] += 1;
            }
        }
        Ok(())
    }

    /// Adds the counts of another one.
    pub fn merge(&mut self, other: &Self) {
        self.bins.iter_mut().zip(&other.bins).for_each(|(mine, theirs)| *mine += theirs);
        (self.low, self.high) = (self.low.min(other.low), self.high.max(other.high));
    }

    /// The smallest and the largest value.
    #[must_use]
    pub fn extremes(&self) -> [f64; 2] {
        [self.low, self.high]
    }

    /// The values below which the given percentages lie; the extremes when those coincide.
    #[must_use]
    pub fn range(&self, percentiles: [f64; 2]) -> GreyRange {
        let total: u64 = self.bins.iter().sum();
        let at = |percent: f64| {
            let rank = (percent / 100.0 * total as f64) as u64;
            let mut seen = 0;
            let bin = self.bins.iter().position(|&count| {
                seen += count;
                seen > rank
            });
            bin.map_or(self.high, |b| value_of(b as u32).clamp(self.low, self.high))
        };
        let (low, high) = (at(percentiles[0]), at(percentiles[1]));
        if low < high { GreyRange { low, high } } else { GreyRange { low: self.low, high: self.high } }
    }
}

/// A histogram in few bytes: of values that occur in it alone.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Told {
    bins: Vec<(u32, u64)>,
    low: f64,
    high: f64,
}

impl Histogram {
    /// What others need to count the same.
    #[must_use]
    pub fn told(&self) -> Told {
        let bins = (0..).zip(&self.bins).filter(|(_, count)| **count > 0).map(|(bin, &count)| (bin, count));
        Told { bins: bins.collect(), low: self.low, high: self.high }
    }

    /// Adds what another one tells.
    #[must_use]
    pub fn and_told(mut self, other: &Told) -> Self {
        for &(bin, count) in &other.bins {
            if let Some(own) = self.bins.get_mut(bin as usize) {
                *own += count;
            }
        }
        (self.low, self.high) = (self.low.min(other.low), self.high.max(other.high));
        self
    }
}

/// The smallest and the largest of some numbers, of which there is at least one.
fn extremes<T: Element>(values: &[T]) -> [T; 2] {
    const LANES: usize = 16;
    let (mut low, mut high) = ([values[0]; LANES], [values[0]; LANES]);
    let mut lanes = values.chunks_exact(LANES);
    // Lanes of their own are told together.
    for some in &mut lanes {
        for n in 0..LANES {
            low[n] = if some[n] < low[n] { some[n] } else { low[n] };
            high[n] = if some[n] > high[n] { some[n] } else { high[n] };
        }
    }
    let rest = lanes.remainder().iter();
    let least = low.iter().chain(rest.clone()).fold(values[0], |a, &b| if b < a { b } else { a });
    let most = high.iter().chain(rest).fold(values[0], |a, &b| if b > a { b } else { a });
    [least, most]
}

/// The bin of a value; bins are ordered as values are.
fn bin_of(value: f64) -> u32 {
    let bits = (value as f32).to_bits();
    let ordered = if bits >> 31 == 1 { !bits } else { bits | 1 << 31 };
    ordered >> (u32::BITS - BIN_BITS)
}

/// The lowest value of a bin.
fn value_of(bin: u32) -> f64 {
    let ordered = bin << (u32::BITS - BIN_BITS);
    let bits = if ordered >> 31 == 1 { ordered & !(1 << 31) } else { !ordered };
    f64::from(f32::from_bits(bits))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of<T: Element>(values: &[T]) -> Histogram {
        let mut counts = Histogram::default();
        counts.add(values).unwrap();
        counts
    }

    #[test]
    fn percentiles_are_those_of_the_sorted_values() {
        let values: Vec<u16> = (0..10_000u32).map(|n| ((n * 7919) % 10_000 / 40) as u16).collect();
        let range = of(&values).range([1.0, 99.0]);
        assert_eq!((range.low, range.high), (2.0, 247.0));
        let constant = of(&[5.0f32; 8]).range([1.0, 99.0]);
        assert_eq!(constant.low, constant.high);
        assert_eq!(Histogram::default().add(&[1.0, f32::NAN, 2.0]), Err(1));
        let mut late = vec![1.0; 3 * TOGETHER];
        (late[2 * TOGETHER + 7], late[2 * TOGETHER + 9]) = (f64::NEG_INFINITY, f64::NAN);
        assert_eq!(Histogram::default().add(&late), Err(2 * TOGETHER + 7));
    }

    #[test]
    fn told_counts_are_those_of_all_values() {
        let values: Vec<f32> = (0..5000u16).map(|n| f32::from(n * 7 % 1999) - 700.5).collect();
        let (one, other) = values.split_at(1234);
        let joined = Histogram::default().and_told(&of(one).told()).and_told(&of(other).told());
        let all = of(&values);
        assert!(joined.bins == all.bins && joined.extremes() == all.extremes());
    }

    #[test]
    fn bins_are_ordered_as_values() {
        let values = [-3e9, -2.0, -1e-9, 0.0, 1e-9, 0.5, 1.0, 255.0, 256.0, 1e12];
        assert!(values.windows(2).all(|w| bin_of(w[0]) < bin_of(w[1])));
        assert!((0..=255u8).all(|v| value_of(bin_of(f64::from(v))) == f64::from(v)));
    }
}
