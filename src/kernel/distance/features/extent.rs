//! What a piece of a distance field holds: its largest finite distance, to either side of a surface, and voxels of which
//! nothing is known.

use crate::kernel::distance::state::precision::{Precision, Real};

/// Values looked at side by side.
const LANES: usize = 16;

/// The largest finite magnitude (0 where there is none) and the number of others.
#[must_use]
pub fn extent<P: Precision>(values: &[P]) -> (f64, u64) {
    pulp::Arch::new().dispatch(Extent(values))
}

/// The search, compiled for each vector unit.
struct Extent<'a, P>(&'a [P]);

impl<P: Precision> pulp::NullaryFnOnce for Extent<'_, P> {
    type Output = (f64, u64);

    #[inline(always)]
    fn call(self) -> (f64, u64) {
        extent_of(self.0)
    }
}

#[inline(always)]
fn extent_of<P: Precision>(values: &[P]) -> (f64, u64) {
    let zero = P::Lane::default();
    let mut largest = [zero; LANES];
    let mut unknown = 0;
    for values in values.chunks(LANES) {
        let mut infinite = [0_u32; LANES];
        for (i, value) in values.iter().enumerate() {
            let value = value.lane();
            let value = value.larger(zero - value);
            let finite = value < P::Lane::INFINITY;
            infinite[i] = u32::from(!finite);
            largest[i] = largest[i].larger(if finite { value } else { zero });
        }
        unknown += u64::from(infinite.iter().sum::<u32>());
    }
    (largest.iter().fold(zero, |most, &value| most.larger(value)).f64(), unknown)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn infinite_values_are_counted_and_left_out() {
        let mut values: Vec<f32> = (0..1000).map(|n| ((n * 37) % 1000) as f32).collect();
        values[999] = f32::INFINITY;
        values[17] = f32::NAN;
        let expected = values.iter().copied().filter(|v| v.is_finite()).fold(0.0, f32::max);
        assert_eq!(extent(&values), (f64::from(expected), 2));
        assert_eq!(extent::<f64>(&[]), (0.0, 0));
        assert_eq!(extent(&[-7.0_f32, 3.0, -0.5]), (7.0, 0), "insides count too");
        assert_eq!(extent(&[f64::INFINITY; 3]), (0.0, 3));
    }
}
