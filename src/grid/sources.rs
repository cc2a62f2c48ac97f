//! Sources of a distance: points in the world, with the object and the contour they were marked on.

/// A point cloud in physical coordinates. A point's index is the source number that distance fields carry.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointCloud {
    /// World positions, `[x, y, z]`, all finite.
    pub positions: Vec<[f64; 3]>,
    /// The object of each point; empty when the file names none (then all belong to object 1).
    pub objects: Vec<u32>,
    /// The contour of each point within its object; empty when the file names none.
    pub contours: Vec<i64>,
}

impl PointCloud {
    /// Number of points.
    #[must_use]
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// True when the cloud has no point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The smallest box that holds all points, `(lowest, highest)`; none for an empty cloud.
    #[must_use]
    pub fn bounds(&self) -> Option<([f64; 3], [f64; 3])> {
        let first = *self.positions.first()?;
        Some(self.positions.iter().fold((first, first), |(lo, hi), p| {
            (std::array::from_fn(|a| lo[a].min(p[a])), std::array::from_fn(|a| hi[a].max(p[a])))
        }))
    }
}
