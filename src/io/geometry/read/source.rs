//! `Source`: what a file of sources holds, points or triangles.

use crate::grid::{PointCloud, TriangleMesh};

/// What distances are measured to; positions are physical.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// Points, at least one.
    Cloud(PointCloud),
    /// Triangles, at least one.
    Mesh(TriangleMesh),
}
