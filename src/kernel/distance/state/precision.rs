//! The numbers that distances are computed with and stored as.
//!
//! Ordered sweeps compute in f64 and round once for each voxel, so that what is stored does not depend on how a formula
//! is written. The front schedule computes f32 and f16 fields in f32, twice as many voxels to a vector.

use std::fmt::Debug;
use std::ops::{Add, Mul, Sub};

use half::f16;

use crate::store::Element;

/// What arithmetic is done in: f32 or f64.
pub trait Real:
    Copy
    + Debug
    + PartialOrd
    + Default
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
{
    /// Where nothing is known.
    const INFINITY: Self;
    /// Whether positions keep their digits anywhere in the world: else they are taken from the grid's origin.
    const KEEPS_WORLD: bool;
    /// The nearest value.
    fn of(value: f64) -> Self;
    /// The nearest value to one of another type.
    fn of_lane<L: Real>(value: L) -> Self;
    /// The value as f64.
    fn f64(self) -> f64;
    /// The square root.
    #[must_use]
    fn root(self) -> Self;
    /// One over the value; infinite for 0.
    #[must_use]
    fn inverse(self) -> Self;
    /// The magnitude.
    #[must_use]
    fn magnitude(self) -> Self;
    /// The value with the sign bit set.
    #[must_use]
    fn marked(self) -> Self;
    /// Whether the sign bit is set.
    fn is_marked(self) -> bool;
    /// The whole number below, or 0 where that is negative; the largest there is for infinity.
    fn whole(self) -> usize;
    /// The smaller of two values that are numbers.
    #[must_use]
    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        if other < self { other } else { self }
    }
    /// The larger of two values that are numbers.
    #[must_use]
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        if other > self { other } else { self }
    }
}

macro_rules! real {
    ($t:ty, $keeps_world:literal) => {
        impl Real for $t {
            const INFINITY: Self = <$t>::INFINITY;
            const KEEPS_WORLD: bool = $keeps_world;
            #[inline(always)]
            fn of(value: f64) -> Self {
                value as $t
            }
            #[inline(always)]
            fn of_lane<L: Real>(value: L) -> Self {
                value.f64() as $t
            }
            #[inline(always)]
            fn f64(self) -> f64 {
                self as f64
            }
            #[inline(always)]
            fn root(self) -> Self {
                self.sqrt()
            }
            #[inline(always)]
            fn inverse(self) -> Self {
                1.0 / self
            }
            #[inline(always)]
            fn magnitude(self) -> Self {
                self.abs()
            }
            #[inline(always)]
            fn marked(self) -> Self {
                -self.abs()
            }
            #[inline(always)]
            fn is_marked(self) -> bool {
                self.is_sign_negative()
            }
            #[inline(always)]
            fn whole(self) -> usize {
                self as usize
            }
        }

        impl Precision for $t {
            type Lane = Self;
            type Fast = Self;
            const MAX: f64 = <$t>::MAX as f64;
            const LEAST: f64 = <$t>::MIN_POSITIVE as f64;
            const UNKNOWN: Self = <$t>::INFINITY;
            #[inline(always)]
            fn lane(self) -> Self {
                self
            }
            #[inline(always)]
            fn of_lane(lane: Self) -> Self {
                lane
            }
            #[inline(always)]
            fn round<A: Real>(value: A) -> Self {
                value.f64() as $t
            }
        }
    };
}

real!(f32, false);
real!(f64, true);

/// What a field is stored as: f16, f32 or f64.
pub trait Precision: Element {
    /// What a stored value is held as while its brick is worked on.
    type Lane: Real;
    /// What the front schedule computes in.
    type Fast: Real;
    /// The largest value that can be stored.
    const MAX: f64;
    /// The smallest value with all its digits.
    const LEAST: f64;
    /// Where nothing is known.
    const UNKNOWN: Self;

    /// A stored value, to work on.
    fn lane(self) -> Self::Lane;
    /// A worked-on value, to store; exact for values that came out of [`Precision::round`].
    fn of_lane(lane: Self::Lane) -> Self;
    /// The nearest value that can be stored.
    fn round<A: Real>(value: A) -> Self::Lane;
}

impl Precision for f16 {
    type Lane = f32;
    type Fast = f32;
    const MAX: f64 = 65504.0;
    const LEAST: f64 = 6.103_515_625e-5;
    const UNKNOWN: Self = Self::INFINITY;

    #[inline(always)]
    fn lane(self) -> f32 {
        self.to_f32()
    }
    #[inline(always)]
    fn of_lane(lane: f32) -> Self {
        Self::from_f32(lane)
    }
    /// Veltkamp's splitting, 1968: the upper 11 of the 24 bits. Values beyond the range become infinite when stored.
    #[inline(always)]
    fn round<A: Real>(value: A) -> f32 {
        let value = value.f64() as f32;
        let scaled = value * 8193.0;
        let upper = scaled - (scaled - value);
        if scaled.is_finite() { upper } else { value }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_to_half_precision_is_what_storing_does() {
        for n in 0..100_000_u32 {
            let value = f64::from(n) * 0.123_456_7 + 1e-3;
            let rounded = <f16 as Precision>::round(value);
            assert_eq!(f16::of_lane(rounded).to_f32(), f16::from_f32(value as f32).to_f32(), "{value}");
            assert_eq!(f16::of_lane(rounded).lane(), rounded, "{value}");
        }
        assert!(<f16 as Precision>::round(f64::INFINITY).is_infinite());
    }
}
