//! Which voxels lie inside closed meshes: generalised winding number above 1/2 (Jacobson 2013; `winding_number`).
//!
//! Between two neighbouring voxels that no triangle fixes there is no surface, so they lie on the same side: of each
//! connected group of such voxels in a box one is asked for its winding number. Every voxel is asked where a mesh is
//! open: the winding number then passes 1/2 also where there is no triangle.

use crate::grid::{Box3, FACES, Geometry, TriangleMesh};
use crate::kernel::geometry::winding_number::WindingTree;

/// What tells the two sides of meshes apart.
#[derive(Clone, Debug)]
pub struct Inside<'a> {
    geometry: &'a Geometry,
    tree: WindingTree,
    is_closed: bool,
}

/// Work buffers: which voxels were told, and those of a group whose neighbours are still to be looked at.
#[derive(Clone, Debug, Default)]
pub struct Flood {
    is_known: Vec<bool>,
    open: Vec<[i64; 3]>,
}

impl<'a> Inside<'a> {
    /// The sides of a mesh, for voxels of a grid.
    #[must_use]
    pub fn new(geometry: &'a Geometry, mesh: &TriangleMesh) -> Self {
        Self { geometry, tree: WindingTree::new(mesh), is_closed: mesh.boundary_edges().is_closed() }
    }

    fn is_inside(&self, voxel: [i64; 3]) -> bool {
        self.tree.winding_number(self.geometry.position(voxel)) > 0.5
    }

    /// For each voxel of a box whether it lies inside, into `inside`. `fixed` is not 0 where a triangle or a point fixed the
    /// voxel. Both are dense `[z][y][x]` over the box.
    pub fn classify(&self, part: &Box3, fixed: &[u8], flood: &mut Flood, inside: &mut Vec<bool>) {
        inside.clear();
        inside.resize(part.len(), false);
        flood.is_known.clear();
        flood.is_known.resize(part.len(), false);
        for (y, z) in part.rows() {
            for x in part.lo[0]..part.hi[0] {
                let at = part.offset_of([x, y, z]);
                if flood.is_known[at] {
                    continue;
                }
                let side = self.is_inside([x, y, z]);
                (inside[at], flood.is_known[at]) = (side, true);
                if self.is_closed && fixed[at] == 0 {
                    flood.open.push([x, y, z]);
                    flood.spread(part, fixed, side, inside);
                }
            }
        }
    }
}

impl Flood {
    /// Carries the side of the open voxels to the whole group.
    fn spread(&mut self, part: &Box3, fixed: &[u8], side: bool, inside: &mut [bool]) {
        while let Some(voxel) = self.open.pop() {
            for face in FACES {
                let mut next = voxel;
                next[face.axis] += if face.upper { 1 } else { -1 };
                if next[face.axis] < part.lo[face.axis] || next[face.axis] >= part.hi[face.axis] {
                    continue;
                }
                let at = part.offset_of(next);
                if !self.is_known[at] && fixed[at] == 0 {
                    (inside[at], self.is_known[at]) = (side, true);
                    self.open.push(next);
                }
            }
        }
    }
}
