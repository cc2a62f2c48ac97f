//! `Geometry`: how a box of voxels lies in the physical world (docs/algorithms.md, "Grid").

use serde::{Deserialize, Serialize};

use super::Box3;

/// So many spacings from zero f32 still tells places on an axis apart that are less than a 4096th of a spacing from each
/// other.
const SINGLE_SPACINGS: f64 = 4096.0;

/// Shape, spacing and place of a grid of voxels. Triples are `[x, y, z]`; lengths are physical.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Geometry {
    /// Voxels along each axis.
    pub shape: [i64; 3],
    /// Distance between voxel centres along each axis.
    pub spacing: [f64; 3],
    /// World position of the centre of voxel (0, 0, 0).
    pub origin: [f64; 3],
    /// Name of the length unit as OME-Zarr spells it (`micrometer`), where it is known.
    pub unit: Option<String>,
}

impl Geometry {
    /// So many voxels along x, y and z, these so far apart, the first one there; in a unit that is not told.
    #[must_use]
    pub fn new(shape: [i64; 3], spacing: [f64; 3], origin: [f64; 3]) -> Self {
        Self { shape, spacing, origin, unit: None }
    }

    /// The box of all voxels.
    #[must_use]
    pub fn domain(&self) -> Box3 {
        Box3::from_shape(self.shape)
    }

    /// World position of a voxel's centre.
    #[must_use]
    pub fn position(&self, voxel: [i64; 3]) -> [f64; 3] {
        std::array::from_fn(|a| self.origin[a] + voxel[a] as f64 * self.spacing[a])
    }

    /// The length of a step of that many voxels along each axis.
    #[must_use]
    pub fn length(&self, step: [i64; 3]) -> f64 {
        (0..3).map(|a| (step[a] as f64 * self.spacing[a]).powi(2)).sum::<f64>().sqrt()
    }

    /// A world position in voxel units, whole numbers at voxel centres.
    #[must_use]
    pub fn to_voxels(&self, position: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|a| (position[a] - self.origin[a]) / self.spacing[a])
    }

    /// The part of the grid inside `part`, as a grid of its own that lies at the same place in the world.
    #[must_use]
    pub fn crop(&self, part: &Box3) -> Self {
        Self { shape: part.shape(), spacing: self.spacing, origin: self.position(part.lo), unit: self.unit.clone() }
    }

    /// The smallest of the three spacings.
    #[must_use]
    pub fn min_spacing(&self) -> f64 {
        self.spacing.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// The largest of the three spacings.
    #[must_use]
    pub fn max_spacing(&self) -> f64 {
        self.spacing.iter().copied().fold(0.0, f64::max)
    }

    /// Whether world positions on the grid can be written in f32: rounding moves none of them by a 4096th of the spacing.
    /// Survey coordinates are too far from zero for that.
    #[must_use]
    pub fn fits_single(&self) -> bool {
        self.lies_within(SINGLE_SPACINGS)
    }

    /// Whether no position on the grid is farther from zero than so many spacings, along any axis.
    fn lies_within(&self, spacings: f64) -> bool {
        let (lo, hi) = (self.position([-1; 3]), self.position(self.shape));
        (0..3).all(|a| lo[a].abs().max(hi[a].abs()) <= spacings * self.spacing[a])
    }

    /// A place near the grid's origin with few digits, for formats that hold f32 alone: seen from there, every position
    /// on the grid fits. Zero for grids of which f32 still holds every place to a 256th of the spacing.
    #[must_use]
    pub fn anchor(&self) -> [f64; 3] {
        if self.lies_within(16.0 * SINGLE_SPACINGS) {
            return [0.0; 3];
        }
        let extent = (0..3).map(|a| self.shape[a] as f64 * self.spacing[a]).fold(0.0, f64::max);
        let digits = libm::log10(extent).ceil() as i32;
        // Divided by a whole number where steps are below 1: the quotient then has no more digits than that.
        let step = 10_f64.powi(digits.abs());
        self.origin.map(|v| if digits < 0 { (v * step).floor() / step } else { (v / step).floor() * step })
    }

    /// Volume of one voxel.
    #[must_use]
    pub fn voxel_volume(&self) -> f64 {
        self.spacing.iter().product()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(origin: [f64; 3], spacing: f64) -> Geometry {
        Geometry { shape: [60; 3], spacing: [spacing; 3], origin, unit: None }
    }

    #[test]
    fn grids_far_from_zero_do_not_fit_single_precision() {
        for (origin, spacing, fits) in [
            ([0.0; 3], 0.04, true),
            ([-3.0, 100.0, 0.0], 0.04, true),
            ([-3.0, 0.0, 170.0], 0.04, false),
            ([499_998.9, 3_999_998.9, 98.9], 0.04, false),
            ([500_000.0, 4_000_000.0, 0.0], 1000.0, true),
            ([0.0, -1e9, 0.0], 0.04, false),
        ] {
            assert_eq!(grid(origin, spacing).fits_single(), fits, "{origin:?}");
        }
    }

    /// Seen from its anchor, a grid lies within a few of its extents from zero, and the anchor is short.
    #[test]
    fn anchors_are_near_and_short() {
        for (origin, spacing, anchor) in [
            ([499_998.9, 3_999_998.9, 98.9], 0.04, [499_990.0, 3_999_990.0, 90.0]),
            ([-1_000_000_000.7, 0.5, -0.5], 0.1, [-1_000_000_010.0, 0.0, -10.0]),
            ([0.123_456, 7.0, 0.0], 1e-6, [0.1234, 7.0, 0.0]),
            ([0.0, 1.0, 2.0], 1.0, [0.0; 3]),
        ] {
            assert_eq!(grid(origin, spacing).anchor(), anchor, "{origin:?}");
        }
    }
}
