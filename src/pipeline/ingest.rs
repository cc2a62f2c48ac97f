//! A stack becomes bricks: planes are decoded in parallel, a slab at a time, and written into the bricks they cross.

use std::sync::{Arc, Mutex, PoisonError};

use super::intensity::GreyRange;
use crate::error::{Error, Result};
use crate::exec::{Engine, Stage, Workers};
use crate::grid::{Box3, BrickGrid, BrickSet};
use crate::store::{BoxSink, BrickArray, Element, PlaneSource, SamplesMut};

/// An element type that stacks hand out: says how its buffers are passed to a reader.
pub trait Sample: Element {
    /// The buffer as the reader wants it.
    fn buffer(out: &mut [Self]) -> SamplesMut<'_>;
}

macro_rules! sample {
    ($type:ty, $variant:ident) => {
        impl Sample for $type {
            fn buffer(out: &mut [Self]) -> SamplesMut<'_> {
                SamplesMut::$variant(out)
            }
        }
    };
}
sample!(u8, U8);
sample!(u16, U16);
sample!(u32, U32);
sample!(f32, F32);
sample!(f64, F64);

/// An image in bricks, with what its histogram tells.
pub struct Image<T: Element> {
    /// The voxels.
    pub bricks: BrickArray<T>,
    /// The grey values taken as black and white.
    pub range: GreyRange,
    /// The smallest and largest value.
    pub extremes: [f64; 2],
}

/// Reads the part `crop` of a stack into bricks; `percentiles` (0..100) of its values become black and white.
///
/// # Errors
/// When the stack cannot be read, holds a value that is no number, or scratch runs out.
pub fn ingest<T: Sample>(
    stage: &Stage<'_>,
    engine: &Engine,
    stack: &dyn PlaneSource,
    crop: &Box3,
    edge: i64,
    percentiles: [f64; 2],
) -> Result<Image<T>> {
    let [width, height, _] = stack.shape();
    let set = Arc::new(BrickSet::dense(BrickGrid::new(crop.shape(), edge)));
    let bricks = BrickArray::<T>::new(engine.scratch(), &set)?;
    let plane_len = (width * height) as usize;
    let planes: Vec<i64> = (crop.lo[2]..crop.hi[2]).collect();
    let workers = Workers::new(move || vec![T::default(); plane_len]);
    // Counts add up the same in any order, and one histogram for all planes bounds the memory.
    let histogram = Mutex::new(Histogram::default());
    stage.run(&planes, &workers, |plane, &z| {
        stack.read_plane(z, T::buffer(plane))?;
        let part = Box3::new([crop.lo[0], crop.lo[1], z], [crop.hi[0], crop.hi[1], z + 1]);
        let whole = Box3::new([0, 0, z], [width, height, z + 1]);
        let cropped = crop_plane(plane, &whole, &part);
        bricks.write_box(&part.translate(crop.lo.map(|v| -v)), &cropped)?;
        let counts = Histogram::of(&cropped).ok_or_else(|| {
            Error::input(format!(
                "plane {z} holds a value that is no number (NaN or infinite); crop it away or repair the image"
            ))
        })?;
        histogram.lock().unwrap_or_else(PoisonError::into_inner).merge(&counts);
        Ok(())
    })?;
    let histogram = histogram.into_inner().unwrap_or_else(PoisonError::into_inner);
    stage.voxels(crop.volume());
    let range = histogram.range(percentiles);
    Ok(Image { bricks, range, extremes: [histogram.low, histogram.high] })
}

fn crop_plane<T: Copy>(plane: &[T], whole: &Box3, part: &Box3) -> Vec<T> {
    let row = |(y, z)| &plane[whole.offset_of([part.lo[0], y, z])..][..part.shape()[0] as usize];
    part.rows().flat_map(row).copied().collect()
}

/// How often values occur: exact to 1 part in 2^16 of the positive and negative number line, in bounded memory.
///
/// A value is counted under the upper bits of its f32 pattern, which are ordered as the numbers are. Integers up to
/// 2^8 have bins of their own; counts add up the same in any order.
#[derive(Clone, Debug)]
struct Histogram {
    bins: Vec<u64>,
    low: f64,
    high: f64,
}

/// Bins are named by this many upper bits of a value's pattern.
const BIN_BITS: u32 = 20;

impl Default for Histogram {
    fn default() -> Self {
        Self { bins: vec![0; 1 << BIN_BITS], low: f64::INFINITY, high: f64::NEG_INFINITY }
    }
}

impl Histogram {
    /// The histogram of some values; none when one of them is no finite number.
    fn of<T: Element>(values: &[T]) -> Option<Self> {
        let mut counts = Self::default();
        for value in values {
            let value = value.to_f64();
            if !value.is_finite() {
                return None;
            }
            (counts.low, counts.high) = (counts.low.min(value), counts.high.max(value));
            counts.bins[bin_of(value) as usize] += 1;
        }
        Some(counts)
    }

    fn merge(&mut self, other: &Self) {
        self.bins.iter_mut().zip(&other.bins).for_each(|(mine, theirs)| *mine += theirs);
        (self.low, self.high) = (self.low.min(other.low), self.high.max(other.high));
    }

    /// The values below which the given percentages lie; the extremes when those coincide.
    fn range(&self, percentiles: [f64; 2]) -> GreyRange {
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

    #[test]
    fn percentiles_are_those_of_the_sorted_values() {
        let values: Vec<u16> = (0..10_000u32).map(|n| ((n * 7919) % 10_000 / 40) as u16).collect();
        let range = Histogram::of(&values).unwrap().range([1.0, 99.0]);
        assert_eq!((range.low, range.high), (2.0, 247.0));
        let constant = Histogram::of(&[5.0f32; 8]).unwrap().range([1.0, 99.0]);
        assert_eq!(constant.low, constant.high);
        assert!(Histogram::of(&[1.0, f32::NAN]).is_none());
    }

    #[test]
    fn bins_are_ordered_as_values() {
        let values = [-3e9, -2.0, -1e-9, 0.0, 1e-9, 0.5, 1.0, 255.0, 256.0, 1e12];
        assert!(values.windows(2).all(|w| bin_of(w[0]) < bin_of(w[1])));
        assert!((0..=255u8).all(|v| value_of(bin_of(f64::from(v))) == f64::from(v)));
    }
}
