//! `Surfel`: a point of a cloud and the direction across its surface.

use glam::DVec3;

/// A point and its normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surfel {
    /// Where it is.
    pub place: DVec3,
    /// Across the surface, unit length.
    pub normal: DVec3,
}
