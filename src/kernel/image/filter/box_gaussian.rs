//! A Gaussian of the same width in voxels along each axis, on one dense box, cut at three widths: one pass along each
//! axis.
//!
//! In: values over a box that reaches [`Gaussian::radius`] voxels around the part that is wanted. The part's values do not depend
//! on the box otherwise: every sum has the same terms in the same order.

use crate::grid::Box3;

/// Where it is cut, in widths.
const CUT: f64 = 3.0;

/// Smooths box by box; keeps its working memory between boxes.
#[derive(Clone, Debug)]
pub struct Gaussian {
    /// Weights from the middle on; the middle counts from either side.
    weights: Vec<f32>,
    passes: [Vec<f32>; 2],
}

impl Gaussian {
    /// A Gaussian of a width in voxels.
    #[must_use]
    pub fn new(sigma: f64) -> Self {
        let value = |n: usize| libm::exp(-0.5 * (n as f64 / sigma).powi(2));
        let radius = (CUT * sigma).ceil() as usize;
        let sum: f64 = value(0) + 2.0 * (1..=radius).map(value).sum::<f64>();
        let weight = |n: usize| value(n) / sum * if n == 0 { 0.5 } else { 1.0 };
        Self { weights: (0..=radius).map(|n| weight(n) as f32).collect(), passes: Default::default() }
    }

    /// How far it reaches, voxels.
    #[must_use]
    pub fn radius(&self) -> i64 {
        self.weights.len() as i64 - 1
    }

    /// Bytes of memory that stay between boxes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.passes.iter().map(|pass| (pass.capacity() * size_of::<f32>()) as u64).sum()
    }

    /// Fills `out` with the smoothed values on `part`; `values` are dense over `around`.
    pub fn smooth(&mut self, values: impl Iterator<Item = f32>, around: &Box3, part: &Box3, out: &mut Vec<f32>) {
        let [first, second] = &mut self.passes;
        first.clear();
        first.extend(values);
        let mut from = *around;
        for axis in 0..3 {
            let mut to = from;
            (to.lo[axis], to.hi[axis]) = (part.lo[axis], part.hi[axis]);
            let into = if axis == 2 { &mut *out } else { &mut *second };
            pass(first, &from, &self.weights, into, &to);
            if axis < 2 {
                std::mem::swap(first, second);
            }
            from = to;
        }
    }
}

/// One pass, along the axis along which the second box is shorter.
fn pass(values: &[f32], from: &Box3, weights: &[f32], out: &mut Vec<f32>, to: &Box3) {
    out.clear();
    out.resize(to.len(), 0.0);
    let [width, height, _] = from.shape().map(|n| n as usize);
    let axis = (0..3).find(|&a| from.shape()[a] != to.shape()[a]).unwrap_or(0);
    let stride = [1, width, width * height][axis];
    let width = to.shape()[0] as usize;
    for (row, (y, z)) in out.chunks_exact_mut(width).zip(to.rows()) {
        let start = from.offset_of([to.lo[0], y, z]);
        for (n, &weight) in weights.iter().enumerate() {
            let (before, behind) = (&values[start - n * stride..][..width], &values[start + n * stride..][..width]);
            row.iter_mut().zip(before).zip(behind).for_each(|((v, a), b)| *v += weight * (a + b));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_becomes_a_gaussian_and_what_is_level_stays() {
        let part = Box3::new([2, 3, 4], [9, 8, 9]);
        let around = part.grow(3);
        let voxels = || around.rows().flat_map(|(y, z)| (around.lo[0]..around.hi[0]).map(move |x| [x, y, z]));
        let mut out = Vec::new();
        Gaussian::new(1.0).smooth(voxels().map(|v| f32::from(u8::from(v == [5, 5, 6]))), &around, &part, &mut out);
        let at = |v| f64::from(out[part.offset_of(v)]);
        let middle = at([5, 5, 6]);
        for (voxel, squared) in [([6, 5, 6], 1.0), ([5, 4, 6], 1.0), ([5, 5, 8], 4.0), ([4, 6, 7], 3.0)] {
            assert!((at(voxel) / middle - (-0.5_f64 * squared).exp()).abs() < 1e-6, "{voxel:?}");
        }
        assert_eq!(at([5, 7, 4]), at([5, 3, 8]));
        Gaussian::new(1.0).smooth(voxels().map(|_| 0.75), &around, &part, &mut out);
        assert!(out.iter().all(|v| (v - 0.75).abs() < 1e-6));
    }
}
