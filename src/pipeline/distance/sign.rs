//! Signed distances: negative inside closed meshes (generalised winding number above 1/2, Jacobson 2013).
//!
//! Between two neighbouring voxels that no triangle fixes there is no surface, so they lie on the same side: of each
//! connected group of such voxels in a box one is asked for its winding number. Every voxel is asked where a mesh is
//! open: the winding number then passes 1/2 also where there is no triangle.

use std::sync::Arc;

use super::Solved;
use crate::error::Result;
use crate::grid::{Box3, Geometry, TriangleMesh};
use crate::kernel::distance::precision::Precision;
use crate::kernel::distance::winding_number::WindingTree;
use crate::store::BoxSource;

/// Distances with a sign.
pub(super) struct Signed<'a, P> {
    distance: Arc<dyn BoxSource<P> + Send + 'a>,
    fixed: Arc<dyn BoxSource<u8> + Send + 'a>,
    geometry: Geometry,
    tree: WindingTree,
    closed: bool,
}

impl<'a, P: Precision> Signed<'a, P> {
    pub(super) fn new(solved: &Solved<'a, P>, geometry: &Geometry, tree: WindingTree, mesh: &TriangleMesh) -> Self {
        let closed = mesh.boundary_edges().is_closed();
        Self { distance: solved.values.clone(), fixed: solved.fixed.clone(), geometry: geometry.clone(), tree, closed }
    }

    fn is_inside(&self, voxel: [i64; 3]) -> bool {
        self.tree.winding_number(self.geometry.position(voxel)) > 0.5
    }

    /// For each voxel of a box whether it lies inside.
    fn inside(&self, part: &Box3) -> Result<Vec<bool>> {
        let mut fixed = vec![0_u8; part.len()];
        self.fixed.read_box(part, &mut fixed)?;
        let mut inside = vec![false; part.len()];
        let shape = part.shape();
        let mut known = vec![false; part.len()];
        let mut group = Vec::new();
        for (y, z) in part.rows() {
            for x in part.lo[0]..part.hi[0] {
                let at = part.offset_of([x, y, z]);
                if known[at] {
                    continue;
                }
                let side = self.is_inside([x, y, z]);
                (inside[at], known[at]) = (side, true);
                if fixed[at] != 0 || !self.closed {
                    continue;
                }
                group.push([x, y, z]);
                while let Some(voxel) = group.pop() {
                    for (axis, step) in [(0, -1), (0, 1), (1, -1), (1, 1), (2, -1), (2, 1)] {
                        let mut next: [i64; 3] = voxel;
                        next[axis] += step;
                        if next[axis] < part.lo[axis] || next[axis] >= part.lo[axis] + shape[axis] {
                            continue;
                        }
                        let at = part.offset_of(next);
                        if !known[at] && fixed[at] == 0 {
                            (inside[at], known[at]) = (side, true);
                            group.push(next);
                        }
                    }
                }
            }
        }
        Ok(inside)
    }
}

impl<P: Precision> BoxSource<P> for Signed<'_, P> {
    fn shape(&self) -> [i64; 3] {
        self.geometry.shape
    }

    fn read_box(&self, part: &Box3, out: &mut [P]) -> Result<()> {
        self.distance.read_box(part, out)?;
        let inside = self.inside(part)?;
        for (value, _) in out.iter_mut().zip(inside).filter(|(_, inside)| *inside) {
            *value = P::from_f64(-value.to_f64());
        }
        Ok(())
    }
}
