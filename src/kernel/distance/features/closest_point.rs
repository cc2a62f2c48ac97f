//! Where on its nearest source a voxel's closest point lies: the point itself, or the place on the triangle.
//!
//! In: sources of voxels, dense `[z][y][x]` over a box, points first and then triangles; out: world coordinates x, y and
//! z, each dense over the same box, NaN where no source is known. Computed in f64.

use crate::grid::{Box3, DataSets, Geometry};
use crate::kernel::geometry::triangle::Triangle;
use crate::store::Element;

/// The points and triangles of data sets, ready to be asked.
#[derive(Clone, Debug)]
pub struct ClosestPoints<'a> {
    geometry: &'a Geometry,
    points: &'a [[f64; 3]],
    triangles: Vec<Triangle>,
}

impl<'a> ClosestPoints<'a> {
    /// Those of some data sets, for voxels of a grid.
    #[must_use]
    pub fn new(geometry: &'a Geometry, sets: &'a DataSets) -> Self {
        let triangles = (0..sets.mesh.len()).map(|n| Triangle::new(sets.mesh.corners(n))).collect();
        Self { geometry, points: &sets.positions, triangles }
    }

    /// The coordinates of the closest points of all voxels of a box.
    pub fn of<T: Element>(&self, part: &Box3, sources: &[u32], out: &mut [Vec<T>; 3]) {
        out.iter_mut().for_each(Vec::clear);
        // Neighbours mostly have one source: whose coordinates are the same if it is a point.
        let mut known = (u32::MAX, [T::from_f64(f64::NAN); 3]);
        let mut sources = sources.iter();
        for (y, z) in part.rows() {
            for (x, &source) in (part.lo[0]..part.hi[0]).zip(sources.by_ref()) {
                let is_point = (source as usize) < self.points.len();
                if !is_point || known.0 != source {
                    known = (source, self.one(source, [x, y, z]).map(T::from_f64));
                }
                out.iter_mut().zip(known.1).for_each(|(out, value)| out.push(value));
            }
        }
    }

    fn one(&self, source: u32, voxel: [i64; 3]) -> [f64; 3] {
        let source = source as usize;
        let triangle = || self.triangles.get(source.checked_sub(self.points.len())?);
        match self.points.get(source) {
            Some(point) => *point,
            None => triangle().map_or([f64::NAN; 3], |triangle| triangle.closest_point(self.geometry.position(voxel))),
        }
    }
}
