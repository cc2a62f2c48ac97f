//! Intensities taken to [0, 1], so that K means the same for 8, 16 and 32 bit images (docs/algorithms.md, "Grey range
//! and presmoothing").

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
        let nearest = |v: i64, a: usize| v.clamp(from.lo[a], from.hi[a] - 1);
        let scale = 1.0 / (self.high - self.low).max(f64::MIN_POSITIVE);
        let seen = |grey: T| ((grey.to_f64() - self.low) * scale).clamp(0.0, 1.0) as f32;
        // Of each row the part that is there is converted in one piece, which the compiler makes vectors of.
        let [first, end] = [to.lo[0], to.hi[0]].map(|x| x.clamp(from.lo[0], from.hi[0]));
        let width = to.shape()[0] as usize;
        let [before, shared] = [first - to.lo[0], end - first].map(|n| n.clamp(0, to.shape()[0]) as usize);
        for (y, z) in to.rows() {
            let row = &mut out[to.offset_of([to.lo[0], y, z])..][..width];
            let grey = &grey[from.offset_of([from.lo[0], nearest(y, 1), nearest(z, 2)])..][..from.shape()[0] as usize];
            let there = &grey[(first - from.lo[0]) as usize..][..shared];
            row[..before].fill(seen(grey[0]));
            row[before + shared..].fill(seen(grey[grey.len() - 1]));
            row[before..][..shared].iter_mut().zip(there).for_each(|(value, &grey)| *value = seen(grey));
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
