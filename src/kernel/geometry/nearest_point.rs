//! `NearestPoint`: how far the nearest point of a cloud is, exactly, by an R-tree.

use rstar::{PointDistance, RTree};

/// A cloud, sorted so that its nearest point is found.
#[derive(Debug)]
pub struct NearestPoint(RTree<[f64; 3]>);

impl NearestPoint {
    /// Bytes of memory for each point: a node is as large as one that holds others, and sorting copies points.
    pub const BYTES: u64 = 120;

    /// Sorts a cloud.
    #[must_use]
    pub fn new(points: Vec<[f64; 3]>) -> Self {
        Self(RTree::bulk_load(points))
    }

    /// The distance from a place to the nearest point; infinite where there is none.
    #[must_use]
    pub fn distance(&self, place: [f64; 3]) -> f64 {
        self.0.nearest_neighbor(place).map_or(f64::INFINITY, |point| point.distance_2(&place).sqrt())
    }
}
