//! Halo exchange: a brick and the faces of its neighbours are gathered into a tile; a tile is scattered back.
//!
//! The plan holds all index thinking and is made once for a grid: for each of the 26 directions, which face of that
//! neighbour holds the ghosts. An edge or a corner of the halo lies in the faces of the diagonal neighbour, so ghosts
//! of any direction come out of the face arena and no neighbour brick's own pages are touched.

use crate::grid::{Box3, BrickGrid, FACES, Face, NEIGHBOURS_26, Slot};
use crate::store::{BrickArray, Element};
use crate::tile::HaloTile;

/// Which ghosts a kernel reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reach {
    /// Only those across the six faces.
    Faces,
    /// All of the ghost layer, edges and corners too.
    All,
}

/// What lies beyond the domain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Boundary<T> {
    /// The nearest voxel inside, repeated: homogeneous Neumann.
    Mirror,
    /// One value.
    Constant(T),
}

/// How the halo of a brick of one grid is filled.
#[derive(Clone, Debug)]
pub struct HaloPlan {
    grid: BrickGrid,
    links: Vec<Link>,
}

/// One direction of the halo: the step to the neighbour and the face of it that holds the ghosts.
#[derive(Clone, Copy, Debug)]
struct Link {
    offset: [i64; 3],
    face: Face,
}

impl HaloPlan {
    /// The plan for all bricks of a grid.
    #[must_use]
    pub fn new(grid: BrickGrid, reach: Reach) -> Self {
        let links = NEIGHBOURS_26
            .iter()
            .filter(|offset| reach == Reach::All || offset.iter().filter(|&&o| o != 0).count() == 1)
            .map(|&offset| {
                // Faces across z, then y, have rows along x: the longest contiguous runs.
                let axis = (0..3).rev().find(|&a| offset[a] != 0).unwrap_or(0);
                Link { offset, face: Face { axis, upper: offset[axis] < 0 } }
            })
            .collect();
        Self { grid, links }
    }

    /// The plan for the ghosts of some directions only; others keep what they hold.
    #[must_use]
    pub fn only(&self, keep: impl Fn([i64; 3]) -> bool) -> Self {
        let links = self.links.iter().copied().filter(|link| keep(link.offset)).collect();
        Self { grid: self.grid, links }
    }

    /// For each direction that ghosts come from, the step to that neighbour and the face of it that is read.
    pub(super) fn reads(&self) -> impl Iterator<Item = ([i64; 3], Face)> {
        self.links.iter().map(|link| (link.offset, link.face))
    }

    /// Fills `tile` with the brick in `slot`, its halo from the neighbours' faces, and beyond the domain by `boundary`.
    pub fn gather<T: Element>(&self, array: &BrickArray<T>, slot: Slot, boundary: Boundary<T>, tile: &mut HaloTile<T>) {
        let id = array.set().id(slot);
        let shape = self.grid.brick_box(id).shape().map(|n| n as usize);
        tile.set_valid(shape);
        match array.unwritten(slot) {
            Some(value) => tile.data_mut().fill(value),
            None => array.read(slot, |brick| copy_brick(brick, shape, tile)),
        }
        self.gather_halo(array, slot, boundary, tile);
    }

    /// Fills only the halo of `tile`, which already holds the brick (or another field's values for it).
    pub fn gather_halo<T: Element>(
        &self,
        array: &BrickArray<T>,
        slot: Slot,
        boundary: Boundary<T>,
        tile: &mut HaloTile<T>,
    ) {
        let id = array.set().id(slot);
        let shape = tile.valid();
        for link in &self.links {
            let Some(neighbour) = self.grid.neighbour(id, link.offset) else { continue };
            let ghosts = ghost_box(shape, link.offset);
            match array.set().slot(neighbour).map(|at| (at, array.unwritten(at))) {
                None => fill(tile, &ghosts, array.absent(neighbour)),
                Some((_, Some(value))) => fill(tile, &ghosts, value),
                Some((at, None)) => array.read_face(at, link.face, |face| self.copy_face(face, link, &ghosts, tile)),
            }
        }
        self.fill_beyond_domain(id, boundary, tile);
    }

    /// Writes the tile's valid voxels back into the brick and its faces.
    pub fn scatter<T: Element>(&self, tile: &HaloTile<T>, array: &BrickArray<T>, slot: Slot) {
        let (edge, valid) = (tile.edge(), tile.valid());
        array.write(slot, |brick| {
            for z in 0..valid[2] {
                for y in 0..valid[1] {
                    let from = tile.at(0, y as isize, z as isize);
                    copy_row(&mut brick[(z * edge + y) * edge..][..valid[0]], &tile.data()[from..][..valid[0]]);
                }
            }
        });
        if array.has_faces() {
            array.write_faces(slot, |faces| scatter_faces(tile, faces));
        }
    }

    fn fill_beyond_domain<T: Element>(&self, id: u64, boundary: Boundary<T>, tile: &mut HaloTile<T>) {
        let (at, counts) = (self.grid.coords(id), self.grid.counts());
        for axis in 0..3 {
            for upper in [false, true] {
                let last = if upper { counts[axis] - 1 } else { 0 };
                if at[axis] == last {
                    match boundary {
                        Boundary::Mirror => tile.mirror(axis, upper),
                        Boundary::Constant(value) => tile.fill_beyond(axis, upper, value),
                    }
                }
            }
        }
    }

    /// Copies the ghosts of one direction out of a neighbour's face.
    fn copy_face<T: Element>(&self, face: &[T], link: &Link, ghosts: &Box3, tile: &mut HaloTile<T>) {
        let edge = self.grid.edge();
        // A ghost's index along an axis, as the neighbour counts it.
        let local = |voxel: i64, axis: usize| voxel - link.offset[axis] * edge;
        let width = ghosts.shape()[0] as usize;
        if link.face.axis == 0 {
            // A column of ghosts for each row of the face.
            let (y, pitch) = (ghosts.lo[1], tile.pitch());
            for z in ghosts.lo[2]..ghosts.hi[2] {
                let to = tile.at(ghosts.lo[0] as isize, y as isize, z as isize);
                let from = (local(z, 2) * edge + local(y, 1)) as usize;
                let column = tile.data_mut()[to..].iter_mut().step_by(pitch);
                column.zip(&face[from..][..ghosts.shape()[1] as usize]).for_each(|(ghost, value)| *ghost = *value);
            }
            return;
        }
        for (y, z) in ghosts.rows() {
            let to = tile.at(ghosts.lo[0] as isize, y as isize, z as isize);
            let (x0, y0, z0) = (local(ghosts.lo[0], 0), local(y, 1), local(z, 2));
            let from = (if link.face.axis == 1 { z0 } else { y0 } * edge + x0) as usize;
            copy_row(&mut tile.data_mut()[to..][..width], &face[from..][..width]);
        }
    }
}

/// Copies a row. Rows of a whole cell, by far the most, and single ghosts are copied without a call.
#[inline(always)]
fn copy_row<T: Copy>(to: &mut [T], from: &[T]) {
    if let (Ok(to), Ok(from)) = (<&mut [T; 16]>::try_from(&mut *to), <&[T; 16]>::try_from(from)) {
        *to = *from;
    } else if let ([to], [from]) = (&mut *to, from) {
        *to = *from;
    } else {
        to.copy_from_slice(from);
    }
}

/// The ghosts in one direction, in the tile's local indices.
fn ghost_box(shape: [usize; 3], offset: [i64; 3]) -> Box3 {
    let shape = shape.map(|n| n as i64);
    Box3::new(
        std::array::from_fn(|a| if offset[a] < 0 { -1 } else { offset[a] * shape[a] }),
        std::array::from_fn(|a| if offset[a] < 0 { 0 } else { shape[a] + offset[a] }),
    )
}

fn fill<T: Element>(tile: &mut HaloTile<T>, part: &Box3, value: T) {
    let width = part.shape()[0] as usize;
    for (y, z) in part.rows() {
        let to = tile.at(part.lo[0] as isize, y as isize, z as isize);
        tile.data_mut()[to..][..width].fill(value);
    }
}

fn copy_brick<T: Element>(brick: &[T], shape: [usize; 3], tile: &mut HaloTile<T>) {
    let edge = tile.edge();
    for z in 0..shape[2] {
        for y in 0..shape[1] {
            let to = tile.at(0, y as isize, z as isize);
            copy_row(&mut tile.data_mut()[to..][..shape[0]], &brick[(z * edge + y) * edge..][..shape[0]]);
        }
    }
}

fn scatter_faces<T: Element>(tile: &HaloTile<T>, faces: &mut [T]) {
    let (edge, valid) = (tile.edge(), tile.valid());
    for face in FACES {
        let layer = if face.upper { valid[face.axis] as isize - 1 } else { 0 };
        let out = &mut faces[face.index() * edge * edge..][..edge * edge];
        let (rows, width) = match face.axis {
            0 => (valid[2], valid[1]),
            1 => (valid[2], valid[0]),
            _ => (valid[1], valid[0]),
        };
        for row in 0..rows {
            let r = row as isize;
            let out = &mut out[row * edge..][..width];
            match face.axis {
                0 => {
                    let column = tile.data()[tile.at(layer, 0, r)..].iter().step_by(tile.pitch());
                    out.iter_mut().zip(column).for_each(|(v, value)| *v = *value);
                }
                1 => copy_row(out, &tile.data()[tile.at(0, layer, r)..][..width]),
                _ => copy_row(out, &tile.data()[tile.at(0, r, layer)..][..width]),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::grid::BrickSet;
    use crate::store::Scratch;

    /// Every ghost equals the voxel the whole volume has there; beyond the domain the nearest one inside.
    #[test]
    fn halos_are_the_neighbouring_voxels() {
        let dir = tempfile::tempdir().unwrap();
        for (shape, edge) in [([19, 9, 8], 4), ([16, 16, 16], 8), ([5, 1, 33], 16)] {
            let grid = BrickGrid::new(shape, edge);
            let set = Arc::new(BrickSet::dense(grid));
            let whole = Box3::from_shape(shape);
            let data: Vec<f32> = (0..whole.len()).map(|n| n as f32).collect();
            let array = BrickArray::with_faces(&Scratch::new(dir.path(), 1 << 30), &set).unwrap();
            array.write_box(&whole, &data);
            (0..set.len() as Slot).for_each(|slot| array.refresh_faces(slot));
            let plan = HaloPlan::new(grid, Reach::All);
            let mut tile = HaloTile::new(edge as usize);
            for slot in 0..set.len() as Slot {
                plan.gather(&array, slot, Boundary::Mirror, &mut tile);
                let valid = grid.brick_box(set.id(slot));
                for (y, z) in valid.grow(1).rows() {
                    for x in valid.lo[0] - 1..=valid.hi[0] {
                        let inside: [i64; 3] = std::array::from_fn(|a| [x, y, z][a].clamp(0, shape[a] - 1));
                        let [i, j, k]: [isize; 3] = std::array::from_fn(|a| ([x, y, z][a] - valid.lo[a]) as isize);
                        assert_eq!(
                            tile.data()[tile.at(i, j, k)],
                            data[whole.offset_of(inside)],
                            "{shape:?} {x} {y} {z}"
                        );
                    }
                }
            }
        }
    }

    /// A tile scattered back leaves the brick as it was and gives the faces their values.
    #[test]
    fn scatter_undoes_gather() {
        let dir = tempfile::tempdir().unwrap();
        let grid = BrickGrid::new([10, 7, 9], 4);
        let set = Arc::new(BrickSet::dense(grid));
        let scratch = Scratch::new(dir.path(), 1 << 30);
        let (a, b) = (BrickArray::with_faces(&scratch, &set).unwrap(), BrickArray::with_faces(&scratch, &set).unwrap());
        let whole = Box3::from_shape(grid.shape());
        let data: Vec<f32> = (0..whole.len()).map(|n| n as f32).collect();
        a.write_box(&whole, &data);
        (0..set.len() as Slot).for_each(|slot| a.refresh_faces(slot));
        let plan = HaloPlan::new(grid, Reach::Faces);
        let mut tile = HaloTile::new(4);
        for slot in 0..set.len() as Slot {
            plan.gather(&a, slot, Boundary::Constant(-1.0), &mut tile);
            plan.scatter(&tile, &b, slot);
            let shape = grid.brick_box(set.id(slot)).shape().map(|n| n as usize);
            b.read(slot, |y| {
                a.read(slot, |x| {
                    for row in 0..shape[1] * 4 {
                        assert_eq!(x[row * 4..][..shape[0]], y[row * 4..][..shape[0]]);
                    }
                });
            });
            for face in FACES {
                let used = [shape[1], shape[0], shape[0]][face.axis];
                b.read_face(slot, face, |y| a.read_face(slot, face, |x| assert_eq!(x[..used], y[..used])));
            }
        }
    }
}
