//! Which voxels lie inside closed meshes: generalised winding number above 1/2 (Jacobson 2013; `winding_number`;
//! docs/algorithms.md, "Signed distance").
//!
//! Between two neighbouring voxels that no triangle fixes there is no surface. Of a closed mesh they lie on the same side, and of
//! each connected group of such voxels in a box one is asked for its winding number. Where a mesh is open the winding number
//! passes 1/2 also where there is no triangle; but there it changes no faster than its rim makes it (`rim`), so that a voxel
//! answers for those of its group that are no farther than the change from its own number to 1/2 needs.

use crate::grid::{Box3, FACES, Geometry, TriangleMesh};
use crate::kernel::geometry::rim::Rim;
use crate::kernel::geometry::winding_number::WindingTree;

/// What the hierarchy's winding number may be off by, at both ends of a change.
const SLACK: f64 = 0.02;

/// How often a reach that turns out too large is halved.
const HALVINGS: u32 = 6;

/// What tells the two sides of meshes apart.
#[derive(Clone, Debug)]
pub struct Inside<'a> {
    geometry: &'a Geometry,
    tree: WindingTree,
    /// Where the mesh is open; none where it is closed.
    rim: Option<Rim>,
}

/// Work buffers: which voxels were told, and those of a group whose neighbours are still to be looked at, now and then.
#[derive(Clone, Debug, Default)]
pub struct Flood {
    is_known: Vec<bool>,
    open: Vec<[i64; 3]>,
    next: Vec<[i64; 3]>,
}

impl<'a> Inside<'a> {
    /// The sides of a mesh, for voxels of a grid.
    #[must_use]
    pub fn new(geometry: &'a Geometry, mesh: &TriangleMesh) -> Self {
        let rim = (!mesh.boundary_edges().is_closed()).then(|| Rim::new(mesh));
        Self { geometry, tree: WindingTree::new(mesh), rim }
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
                let place = self.geometry.position([x, y, z]);
                let number = self.tree.winding_number(place);
                let side = number > 0.5;
                (inside[at], flood.is_known[at]) = (side, true);
                let steps = if fixed[at] == 0 { self.steps(place, number) } else { 0 };
                if steps > 0 {
                    flood.open.push([x, y, z]);
                    flood.spread(part, fixed, (side, steps), inside);
                }
            }
        }
    }

    /// From voxel to voxel that no triangle fixes, how many steps lead to none on another side.
    fn steps(&self, place: [f64; 3], number: f64) -> u64 {
        let Some(rim) = &self.rim else { return u64::MAX };
        let room = (number - 0.5).abs() - SLACK;
        let step = self.geometry.max_spacing();
        let mut reach = 0.5 * room / rim.steepest(place, 0.0);
        for _ in 0..HALVINGS {
            if reach.is_nan() || reach < step {
                return 0;
            }
            if reach * rim.steepest(place, reach) <= room {
                return (reach / step) as u64;
            }
            reach *= 0.5;
        }
        0
    }
}

impl Flood {
    /// Carries the side of the open voxels to those of the group that so many steps lead to.
    fn spread(&mut self, part: &Box3, fixed: &[u8], (side, steps): (bool, u64), inside: &mut [bool]) {
        let mut left = steps;
        while left > 0 && !self.open.is_empty() {
            left -= 1;
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
                        self.next.push(next);
                    }
                }
            }
            std::mem::swap(&mut self.open, &mut self.next);
        }
        self.open.clear();
    }
}
