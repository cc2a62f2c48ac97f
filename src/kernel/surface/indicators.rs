//! Indicator functions of the labels in one box, each 1 in its label and 0 elsewhere, smoothed: surfaces between labels
//! that lie where two of them are equal have no staircases. The label of a voxel is then that of the largest.
//!
//! Smoothing is a Gaussian of one voxel along each axis (`kernel::image::gaussian`); spacing has no part in it, as stairs are made of
//! voxels. Where a flat surface crosses an edge between voxels the smoothed step is an error function; its values are
//! taken through the inverse, so that they are straight there and crossings are found where the surface is.

use crate::grid::Box3;
use crate::kernel::image::gaussian::Gaussian;

/// Width of the smoothing, voxels.
const SIGMA: f64 = 1.0;
/// Values as near to 0 or 1 as this are that far from the surface that they tell nothing of it.
const LEAST: f64 = 1e-4;

/// The smoothed indicator functions of the labels in a box.
#[derive(Clone, Debug)]
pub(super) struct Indicators {
    names: Vec<u32>,
    /// By label, dense over the box.
    values: Vec<Vec<f32>>,
    gaussian: Gaussian,
    /// The label of the largest at each voxel, as a place in `names`.
    largest: Vec<u32>,
}

impl Default for Indicators {
    fn default() -> Self {
        let gaussian = Gaussian::new(SIGMA);
        Self { names: Vec::new(), values: Vec::new(), gaussian, largest: Vec::new() }
    }
}

impl Indicators {
    /// Smooths the labels, dense over `around`, on `part`, around which that reaches as far as the Gaussian.
    pub(super) fn enter(&mut self, labels: &[u32], around: &Box3, part: &Box3) {
        self.names.clear();
        self.names.extend(labels.chunk_by(|a, b| a == b).map(|run| run[0]));
        self.names.sort_unstable();
        self.names.dedup();
        self.values.resize(self.names.len(), Vec::new());
        for (&name, values) in self.names.iter().zip(&mut self.values) {
            let indicator = labels.iter().map(|&label| f32::from(u8::from(label == name)));
            self.gaussian.smooth(indicator, around, part, values);
        }
        self.largest.clear();
        self.largest.resize(part.len(), 0);
        for n in 1..self.names.len() {
            for (at, largest) in self.largest.iter_mut().enumerate() {
                if self.values[n][at] > self.values[*largest as usize][at] {
                    *largest = n as u32;
                }
            }
        }
    }

    /// Whether there is one label only.
    pub(super) fn is_one(&self) -> bool {
        self.names.len() < 2
    }

    /// The label of the largest function at a place in the box.
    pub(super) fn label(&self, at: usize) -> u32 {
        self.names[self.largest[at] as usize]
    }

    /// How far a place lies on the side of one label, as seen from another, in voxels where the surface is flat.
    pub(super) fn lead(&self, at: usize, label: u32, other: u32) -> f64 {
        let value = |name: u32| self.names.binary_search(&name).map_or(0.0, |n| f64::from(self.values[n][at]));
        let (own, its) = (value(label), value(other));
        // Of both together, so that a third label near takes nothing from either.
        let part = if own + its > 0.0 { own / (own + its) } else { 0.5 };
        SIGMA * normal_quantile(part.clamp(LEAST, 1.0 - LEAST))
    }
}

/// The argument at which the normal distribution has a value, to 5e-4 (Abramowitz & Stegun 1964, 26.2.23).
fn normal_quantile(value: f64) -> f64 {
    let tail = value.min(1.0 - value);
    let t = (-2.0 * tail.ln()).sqrt();
    let upper = 2.515_517 + t * (0.802_853 + t * 0.010_328);
    let lower = 1.0 + t * (1.432_788 + t * (0.189_269 + t * 0.001_308));
    // A half has the argument 0, which the formula misses by its error.
    let found = (t - upper / lower).max(0.0);
    if value < 0.5 { -found } else { found }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flat_step_is_straight_across_the_surface() {
        let part = Box3::new([-3, 0, 0], [4, 1, 1]);
        let around = part.grow(3);
        let voxels = around.rows().flat_map(|(y, z)| (around.lo[0]..around.hi[0]).map(move |x| [x, y, z]));
        let labels: Vec<u32> = voxels.map(|v| if v[0] < 1 { 4 } else { 2 }).collect();
        let mut indicators = Indicators::default();
        indicators.enter(&labels, &around, &part);
        for (at, x) in (-3..4).enumerate() {
            let expected = 0.5 - f64::from(x);
            let found = indicators.lead(at, 4, 2);
            // A step of voxels is that of the continuum within a few hundredths.
            assert!((found - expected).abs() < 0.05 * (1.0 + expected.abs()), "{x}: {found}");
            assert_eq!(indicators.label(at), if x < 1 { 4 } else { 2 });
        }
    }

    #[test]
    fn quantiles_of_the_normal_distribution() {
        for (value, argument) in [(0.5, 0.0), (0.841_345, 1.0), (0.022_75, -2.0), (0.308_538, -0.5)] {
            assert!((normal_quantile(value) - argument).abs() < 1e-3, "{value}");
        }
    }
}
