//! `Geometry`: how a box of voxels lies in the physical world (docs/algorithms.md, "Grid").

use super::Box3;

/// Shape, spacing and place of a grid of voxels. Triples are `[x, y, z]`; lengths are physical.
#[derive(Clone, Debug, PartialEq)]
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

    /// Volume of one voxel.
    #[must_use]
    pub fn voxel_volume(&self) -> f64 {
        self.spacing.iter().product()
    }
}
