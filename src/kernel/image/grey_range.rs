//! Intensities taken to [0, 1], so that K means the same for 8, 16 and 32 bit images (algorithms: section 6).

use crate::grid::Box3;
use crate::store::Element;

/// The grey values that become 0 and 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GreyRange {
    /// Becomes 0.
    pub low: f64,
    /// Becomes 1.
    pub high: f64,
}

impl GreyRange {
    /// Takes the grey values of the box `from` to [0, 1] on the box `to`, which may reach past it: there its border is
    /// repeated. Both dense `[z][y][x]`, both boxes in voxels of one grid.
    pub fn normalise<T: Element>(&self, grey: &[T], from: &Box3, to: &Box3, out: &mut [f32]) {
        let nearest = |v: [i64; 3]| -> [i64; 3] { std::array::from_fn(|a| v[a].clamp(from.lo[a], from.hi[a] - 1)) };
        let scale = 1.0 / (self.high - self.low).max(f64::MIN_POSITIVE);
        for (y, z) in to.rows() {
            let row = &mut out[to.offset_of([to.lo[0], y, z])..][..to.shape()[0] as usize];
            for (x, value) in (to.lo[0]..).zip(row) {
                let grey = grey[from.offset_of(nearest([x, y, z]))].to_f64();
                *value = ((grey - self.low) * scale).clamp(0.0, 1.0) as f32;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_scaled_and_the_border_is_repeated() {
        let range = GreyRange { low: 10.0, high: 30.0 };
        // Two rows of two voxels, seen from one column before to one row beyond them.
        let (from, to) = (Box3::new([4, 7, 0], [6, 9, 1]), Box3::new([3, 7, 0], [6, 10, 1]));
        let mut out = [9.0; 9];
        range.normalise(&[0_u16, 20, 30, 99], &from, &to, &mut out);
        assert_eq!(out, [0.0, 0.0, 0.5, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]);
        range.normalise(&[15_u8; 4], &from, &to, &mut out);
        assert_eq!(out, [0.25; 9]);
        let constant = GreyRange { low: 5.0, high: 5.0 };
        constant.normalise(&[5.0_f32; 4], &from, &to, &mut out);
        assert_eq!(out, [0.0; 9], "no range, no contrast");
    }
}
