//! Indicator functions of the labels in one box, each 1 in its label and 0 elsewhere, smoothed: surfaces between labels
//! told from these have no staircases. A voxel of which another label has more than half takes that.
//!
//! Between two labels the surface lies where they are equal. Across a flat one the smoothed step is an error function;
//! taken through its inverse it is straight, and crossings are found where the surface is. At a line where three labels
//! meet equality would not do: each has the part of its angle there, and the larger advances, by 0.43 of the Gaussian's
//! width at the rim of a face. But a Gaussian of twice the width sees the same parts at the line. So where there are
//! others, two labels are equal where what the narrow one sees of them, over what the wide one does, is the same. On
//! curved surfaces that is off, as the wide one sees less of what bulges; equality alone is not.
//!
//! Widths are in voxels along each axis (`kernel::image::filter::box_gaussian`); spacing has no part in it, as stairs are made of
//! voxels.

use super::sides::Sides;
use crate::grid::Box3;
use crate::kernel::image::filter::box_gaussian::Gaussian;

/// Widths of the two Gaussians, voxels.
const SIGMAS: [f64; 2] = [1.0, 2.0];
/// How far the wider one reaches, voxels.
pub(crate) const RADIUS: i64 = 6;
/// What the excess of one label over another grows by in one width of the narrow Gaussian, on a flat surface.
const SLOPE: f64 = 0.85;
/// With so much of other labels two are told apart by their excess alone.
const THIRDS: f64 = 0.2;
/// Less of a label is not told from nothing.
const LEAST: f32 = 1e-4;

/// The smoothed indicator functions of the labels in a box.
#[derive(Clone, Debug)]
pub struct Indicators {
    names: Vec<u32>,
    /// By label, dense over the box: what the narrow Gaussian sees, and the logarithm of it over what the wide one does.
    narrow: Vec<Vec<f32>>,
    excess: Vec<Vec<f32>>,
    gaussians: [Gaussian; 2],
    /// The label of each voxel.
    labels: Vec<u32>,
    part: Box3,
}

impl Default for Indicators {
    fn default() -> Self {
        let gaussians = SIGMAS.map(Gaussian::new);
        Self {
            names: Vec::new(),
            narrow: Vec::new(),
            excess: Vec::new(),
            gaussians,
            labels: Vec::new(),
            part: Box3::from_shape([0; 3]),
        }
    }
}

impl Sides for Indicators {
    fn enter(&mut self, labels: &[u32], around: &Box3, part: &Box3) {
        self.part = *part;
        self.names.clear();
        self.names.extend(labels.chunk_by(|a, b| a == b).map(|run| run[0]));
        self.names.sort_unstable();
        self.names.dedup();
        self.narrow.resize(self.names.len(), Vec::new());
        self.excess.resize(self.names.len(), Vec::new());
        self.labels.clear();
        for (y, z) in part.rows() {
            let row = &labels[around.offset_of([part.lo[0], y, z])..][..part.shape()[0] as usize];
            self.labels.extend_from_slice(row);
        }
        if self.is_one() {
            return;
        }
        let [narrow, wide] = &mut self.gaussians;
        let near = part.grow(narrow.radius());
        for (n, &name) in self.names.iter().enumerate() {
            let (seen, excess) = (&mut self.narrow[n], &mut self.excess[n]);
            let indicator = |label: u32| f32::from(u8::from(label == name));
            let rows = near
                .rows()
                .flat_map(|(y, z)| labels[around.offset_of([near.lo[0], y, z])..][..near.shape()[0] as usize].iter());
            narrow.smooth(rows.map(|&label| indicator(label)), &near, part, seen);
            wide.smooth(labels.iter().map(|&label| indicator(label)), around, part, excess);
            for ((excess, &narrow), label) in excess.iter_mut().zip(&*seen).zip(&mut self.labels) {
                *excess = libm::logf(narrow.max(LEAST) / excess.max(LEAST));
                if narrow > 0.5 {
                    *label = name;
                }
            }
        }
    }

    fn bytes(&self) -> u64 {
        let of_fields: usize =
            self.narrow.iter().chain(&self.excess).map(|field| field.capacity() * size_of::<f32>()).sum();
        let of_labels = self.labels.capacity() * size_of::<u32>();
        (of_fields + of_labels) as u64 + self.gaussians.iter().map(Gaussian::bytes).sum::<u64>()
    }

    fn is_one(&self) -> bool {
        self.names.len() < 2
    }

    fn label(&self, at: usize) -> u32 {
        self.labels[at]
    }

    fn between(&self, ends: [[i64; 3]; 2], [own, other]: [u32; 2]) -> f64 {
        let [from, to] = ends.map(|voxel| self.lead(self.part.offset_of(voxel), own, other));
        if from > to { from / (from - to) } else { 0.5 }
    }
}

impl Indicators {
    /// How far a place lies on the side of one label, as seen from another, in voxels where the surface is flat.
    pub(crate) fn lead(&self, at: usize, label: u32, other: u32) -> f64 {
        let [own, its] = [label, other].map(|name| {
            let found = self.names.binary_search(&name);
            found.map_or((0.0, 0.0), |n| (f64::from(self.narrow[n][at]), f64::from(self.excess[n][at])))
        });
        let both = own.0 + its.0;
        let part = if both > 0.0 { own.0 / both } else { 0.5 };
        let plain = SIGMAS[0] * normal_quantile(part.clamp(f64::from(LEAST), 1.0 - f64::from(LEAST)));
        let by_excess = (own.1 - its.1) * SIGMAS[0] / SLOPE;
        let thirds = ((1.0 - both) / THIRDS).clamp(0.0, 1.0);
        plain + thirds * (by_excess - plain)
    }
}

/// The argument at which the normal distribution has a value, to 5e-4 (Abramowitz & Stegun 1964, 26.2.23).
fn normal_quantile(value: f64) -> f64 {
    let tail = value.min(1.0 - value);
    let t = (-2.0 * libm::log(tail)).sqrt();
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
        let around = part.grow(RADIUS);
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

    #[test]
    fn reaches_as_far_as_it_says() {
        assert_eq!(Indicators::default().gaussians.map(|gaussian| gaussian.radius()), [3, RADIUS]);
    }
}
