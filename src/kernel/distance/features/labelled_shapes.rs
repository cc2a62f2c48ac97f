//! Points and triangles with the labels of their data sets, and how far they are from any place: what a surface between
//! labels is drawn from. Exact distances, f64 (to triangles Eberly 1999).

use crate::grid::DataSets;
use crate::kernel::distance::state::source::squared_distance;
use crate::kernel::geometry::triangle::Triangle;

/// The sources of a run, ready to be asked for distances.
#[derive(Clone, Debug)]
pub struct LabelledShapes<'a> {
    sets: &'a DataSets,
    triangles: Vec<Triangle>,
}

impl<'a> LabelledShapes<'a> {
    /// Of data sets.
    #[must_use]
    pub fn new(sets: &'a DataSets) -> Self {
        Self { sets, triangles: (0..sets.mesh.len()).map(|n| Triangle::new(sets.mesh.corners(n))).collect() }
    }

    /// The data sets.
    #[must_use]
    pub fn sets(&self) -> &'a DataSets {
        self.sets
    }

    /// The label of a source; 0 for none.
    #[must_use]
    pub fn label(&self, source: u32) -> u32 {
        self.sets.label(source)
    }

    /// Whether a source is a point; else it is a triangle, or none.
    #[must_use]
    pub fn is_point(&self, source: u32) -> bool {
        (source as usize) < self.sets.positions.len()
    }

    /// The place of a source that is closest to a world position; that position itself where there is none.
    #[must_use]
    pub fn closest(&self, here: [f64; 3], source: u32) -> [f64; 3] {
        let source = source as usize;
        if let Some(&point) = self.sets.positions.get(source) {
            return point;
        }
        let triangle = self.triangles.get(source - self.sets.positions.len());
        triangle.map_or(here, |triangle| triangle.closest_point(here))
    }

    /// A ball that holds a source: its middle and radius.
    #[must_use]
    pub fn ball(&self, source: u32) -> ([f64; 3], f64) {
        let source = source as usize;
        if let Some(&point) = self.sets.positions.get(source) {
            return (point, 0.0);
        }
        let triangle = self.triangles.get(source - self.sets.positions.len());
        triangle.map_or(([0.0; 3], f64::INFINITY), |triangle| (triangle.corner(), triangle.longest_from_corner()))
    }

    /// The distance of a world position to a source, physical; infinite to none.
    #[must_use]
    pub fn distance(&self, here: [f64; 3], source: u32) -> f64 {
        self.distance_squared(here, source).sqrt()
    }

    /// The squared distance of a world position to a source, physical; infinite to none.
    #[must_use]
    pub fn distance_squared(&self, here: [f64; 3], source: u32) -> f64 {
        let source = source as usize;
        if let Some(&point) = self.sets.positions.get(source) {
            return squared_distance(here, point);
        }
        let triangle = self.triangles.get(source - self.sets.positions.len());
        triangle.map_or(f64::INFINITY, |triangle| triangle.distance_squared(here))
    }
}
