//! `BrickArray<T>`: one field, brick by brick, in memory-mapped scratch.
//!
//! A brick is `edge`^3 voxels, contiguous, `[z][y][x]`; bricks at the far ends of the domain have the same room and
//! leave the rest unused. Bricks hold no halo. The six faces of every brick are kept a second time, in an arena of
//! their own, so that filling a neighbour's halo never touches this brick's pages:
//!
//! ```text
//! faces of one brick | -x [z][y] | +x [z][y] | -y [z][x] | +y [z][x] | -z [y][x] | +z [y][x] |    edge^2 each
//! ```
//!
//! Of ghost bricks, which another rank owns, only the faces are stored.
//! Bricks outside of the set are not stored: each has one constant value for all its voxels. So have, where an array is
//! made for it, bricks that nothing was written to yet.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use super::scratch::Scratch;
use super::slot_file::SlotFile;
use super::{BoxSource, Element};
use crate::error::Result;
use crate::grid::{Box3, BrickId, BrickSet, FACES, Face, Slot};

/// One field over a set of bricks.
pub struct BrickArray<T: Element> {
    set: Arc<BrickSet>,
    /// Values of one brick, all layers together.
    brick_len: usize,
    bricks: SlotFile<T>,
    faces: Option<SlotFile<T>>,
    absent: Absent<T>,
    blank: Option<Blank<T>>,
}

/// What bricks hold that are not stored: most often the same everywhere.
struct Absent<T> {
    all: T,
    /// For each brick of the grid, where some hold another.
    each: Vec<T>,
}

/// What bricks hold that were not written yet, and which these are.
struct Blank<T> {
    value: T,
    written: Box<[AtomicBool]>,
}

impl<T: Element> BrickArray<T> {
    /// A field of zeros without faces: for what is read and written by boxes, or voxel by voxel.
    ///
    /// # Errors
    /// When the scratch folder cannot hold it.
    pub fn new(scratch: &Scratch, set: &Arc<BrickSet>) -> Result<Self> {
        Self::with_layers(scratch, set, 1)
    }

    /// A field of several values per voxel, `[layer][z][y][x]` in each brick, without faces. Boxes are read from and
    /// written to the first layer.
    ///
    /// # Errors
    /// When the scratch folder cannot hold it.
    pub fn with_layers(scratch: &Scratch, set: &Arc<BrickSet>, layers: usize) -> Result<Self> {
        let brick_len = layers * set.grid().brick_len();
        let bricks = SlotFile::create(&scratch.dir, &scratch.window, brick_len, set.owned().len())?;
        let absent = Absent { all: T::default(), each: Vec::new() };
        Ok(Self { set: set.clone(), brick_len, bricks, faces: None, absent, blank: None })
    }

    /// A field of zeros with faces: for what kernels read with a halo.
    ///
    /// # Errors
    /// When the scratch folder cannot hold it.
    pub fn with_faces(scratch: &Scratch, set: &Arc<BrickSet>) -> Result<Self> {
        Self::new(scratch, set)?.and_faces(scratch)
    }

    fn and_faces(self, scratch: &Scratch) -> Result<Self> {
        let area = (self.set.grid().edge() * self.set.grid().edge()) as usize;
        let faces = SlotFile::create(&scratch.dir, &scratch.window, 6 * area, self.set.len())?;
        Ok(Self { faces: Some(faces), ..self })
    }

    /// A field with faces whose bricks are `value` throughout until they are written, and cost nothing until then.
    ///
    /// # Errors
    /// When the scratch folder cannot hold it.
    pub fn blank(scratch: &Scratch, set: &Arc<BrickSet>, value: T) -> Result<Self> {
        Ok(Self::with_faces(scratch, set)?.and_blank(value))
    }

    /// The faces alone of a field made [`BrickArray::blank`]: there are no bricks to read or write.
    ///
    /// # Errors
    /// When the scratch folder cannot hold it.
    pub fn blank_faces(scratch: &Scratch, set: &Arc<BrickSet>, value: T) -> Result<Self> {
        Ok(Self::with_layers(scratch, set, 0)?.and_faces(scratch)?.and_blank(value))
    }

    fn and_blank(mut self, value: T) -> Self {
        self.set_all_absent(value);
        let written = self.set.ids().map(|_| AtomicBool::new(false)).collect();
        self.blank = Some(Blank { value, written });
        self
    }

    /// The value of all voxels of a stored brick that was not written yet, in an array made [`BrickArray::blank`].
    #[must_use]
    pub fn unwritten(&self, slot: Slot) -> Option<T> {
        let blank = self.blank.as_ref()?;
        (!blank.written[slot as usize].load(Relaxed)).then_some(blank.value)
    }

    /// Values of a brick, all layers together.
    pub(super) fn values_of_brick(&self) -> usize {
        self.brick_len
    }

    /// The bricks that are stored.
    #[must_use]
    pub fn set(&self) -> &Arc<BrickSet> {
        &self.set
    }

    /// Gives a brick that is not stored its constant value.
    pub fn set_absent(&mut self, id: BrickId, value: T) {
        if self.absent.each.is_empty() {
            if value == self.absent.all {
                return;
            }
            self.absent.each = vec![self.absent.all; self.set.grid().len() as usize];
        }
        self.absent.each[id as usize] = value;
    }

    /// Gives all bricks that are not stored one value.
    pub fn set_all_absent(&mut self, value: T) {
        self.absent = Absent { all: value, each: Vec::new() };
    }

    /// Gives all bricks that are not stored the values that they have in another field of the same grid.
    pub fn take_absent(&mut self, from: &Self) {
        self.absent = Absent { all: from.absent.all, each: from.absent.each.clone() };
    }

    /// The constant value of a brick that is not stored.
    #[must_use]
    pub fn absent(&self, id: BrickId) -> T {
        self.absent.each.get(id as usize).copied().unwrap_or(self.absent.all)
    }

    /// The place of a brick in the file of bricks.
    fn place(&self, slot: Slot) -> usize {
        slot.checked_sub(self.set.owned().start).expect("a rank reads and writes its own bricks only") as usize
    }

    /// Lends out a brick's voxels, `edge`^3 for each layer, for reading.
    ///
    /// # Panics
    /// When the brick is another rank's.
    pub fn read<R>(&self, slot: Slot, f: impl FnOnce(&[T]) -> R) -> R {
        self.bricks.read(self.place(slot), 0..self.brick_len, f)
    }

    /// Lends out a brick's voxels for writing. The faces follow with [`BrickArray::write_faces`].
    ///
    /// # Panics
    /// When the brick is another rank's.
    pub fn write<R>(&self, slot: Slot, f: impl FnOnce(&mut [T]) -> R) -> R {
        self.mark_written(slot);
        self.bricks.write(self.place(slot), f)
    }

    fn mark_written(&self, slot: Slot) {
        if let Some(blank) = &self.blank {
            blank.written[slot as usize].store(true, Relaxed);
        }
    }

    /// Lends out one face of a brick, `edge`^2 voxels.
    ///
    /// # Panics
    /// When the array was made without faces.
    pub fn read_face<R>(&self, slot: Slot, face: Face, f: impl FnOnce(&[T]) -> R) -> R {
        let area = (self.set.grid().edge() * self.set.grid().edge()) as usize;
        let faces = self.faces.as_ref().expect("halos are read from arrays made with faces");
        faces.read(slot as usize, face.index() * area..(face.index() + 1) * area, f)
    }

    /// Lends out the six faces of a brick, `edge`^2 voxels each, for writing.
    ///
    /// # Panics
    /// When the array was made without faces.
    pub fn write_faces<R>(&self, slot: Slot, f: impl FnOnce(&mut [T]) -> R) -> R {
        self.mark_written(slot);
        self.faces.as_ref().expect("halos are read from arrays made with faces").write(slot as usize, f)
    }

    /// True when neighbours can read this array's faces.
    #[must_use]
    pub fn has_faces(&self) -> bool {
        self.faces.is_some()
    }

    /// The one value of a brick that is not stored or not written yet; else its slot.
    fn constant(&self, id: BrickId) -> std::result::Result<T, Slot> {
        match self.set.slot(id) {
            None => Ok(self.absent(id)),
            Some(slot) => self.unwritten(slot).ok_or(slot),
        }
    }

    /// Copies a brick's outermost layers into the face arena.
    pub fn refresh_faces(&self, slot: Slot) {
        let edge = self.set.grid().edge() as usize;
        let shape = self.set.grid().brick_box(self.set.id(slot)).shape().map(|n| n as usize);
        self.read(slot, |brick| self.write_faces(slot, |faces| copy_faces(brick, edge, shape, faces)));
    }
}

/// Copies the six outermost layers of a brick, whose valid extents are `shape`, into `faces`.
fn copy_faces<T: Element>(brick: &[T], edge: usize, shape: [usize; 3], faces: &mut [T]) {
    let area = edge * edge;
    for face in FACES {
        let out = &mut faces[face.index() * area..][..area];
        let layer = if face.upper { shape[face.axis] - 1 } else { 0 };
        match face.axis {
            0 => (0..area).for_each(|row| out[row] = brick[row * edge + layer]),
            1 => (0..edge)
                .for_each(|z| out[z * edge..][..edge].copy_from_slice(&brick[z * area + layer * edge..][..edge])),
            _ => out.copy_from_slice(&brick[layer * area..][..area]),
        }
    }
}

impl<T: Element> BoxSource<T> for BrickArray<T> {
    fn shape(&self) -> [i64; 3] {
        self.set.grid().shape()
    }

    fn read_box(&self, part: &Box3, out: &mut [T]) -> Result<()> {
        let grid = *self.set.grid();
        for id in grid.bricks_in(part) {
            let shared = grid.brick_box(id).intersect(part);
            let width = shared.shape()[0] as usize;
            let rows = RowsOf { brick_lo: grid.coords(id).map(|c| c * grid.edge()), edge: grid.edge() };
            match self.constant(id) {
                Ok(value) => shared.rows().for_each(|(y, z)| {
                    out[part.offset_of([shared.lo[0], y, z])..][..width].fill(value);
                }),
                Err(slot) => self.read(slot, |brick| {
                    for (y, z) in shared.rows() {
                        let from = rows.offset([shared.lo[0], y, z]);
                        out[part.offset_of([shared.lo[0], y, z])..][..width].copy_from_slice(&brick[from..][..width]);
                    }
                }),
            }
        }
        Ok(())
    }

    fn constant_in(&self, part: &Box3) -> Option<T> {
        let mut ids = self.set.grid().bricks_in(part);
        let first = ids.next().and_then(|id| self.constant(id).ok())?;
        ids.all(|id| self.constant(id) == Ok(first)).then_some(first)
    }
}

impl<T: Element> BrickArray<T> {
    /// Writes `data`, dense `[z][y][x]` over `part`, to stored bricks; what lies in others is passed over.
    pub fn write_box(&self, part: &Box3, data: &[T]) {
        let grid = *self.set.grid();
        for (id, slot) in grid.bricks_in(part).filter_map(|id| Some((id, self.set.slot(id)?))) {
            let shared = grid.brick_box(id).intersect(part);
            let width = shared.shape()[0] as usize;
            let rows = RowsOf { brick_lo: grid.coords(id).map(|c| c * grid.edge()), edge: grid.edge() };
            self.write(slot, |brick| {
                for (y, z) in shared.rows() {
                    let to = rows.offset([shared.lo[0], y, z]);
                    brick[to..][..width].copy_from_slice(&data[part.offset_of([shared.lo[0], y, z])..][..width]);
                }
            });
        }
    }
}

/// Where a voxel of the domain lies inside its brick's storage.
struct RowsOf {
    brick_lo: [i64; 3],
    edge: i64,
}

impl RowsOf {
    fn offset(&self, voxel: [i64; 3]) -> usize {
        let [x, y, z]: [i64; 3] = std::array::from_fn(|a| voxel[a] - self.brick_lo[a]);
        ((z * self.edge + y) * self.edge + x) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::BrickGrid;

    fn numbered(shape: [i64; 3]) -> Vec<f32> {
        (0..Box3::from_shape(shape).len()).map(|n| n as f32).collect()
    }

    #[test]
    fn boxes_come_back_as_written_for_any_brick_and_window() {
        let dir = tempfile::tempdir().unwrap();
        let shape = [37, 21, 18];
        let whole = Box3::from_shape(shape);
        for (edge, window) in [(4, 1 << 30), (8, 0), (16, 1 << 20), (64, 1 << 30)] {
            let set = Arc::new(BrickSet::dense(BrickGrid::new(shape, edge)));
            let array = BrickArray::<f32>::new(&Scratch::new(dir.path(), window), &set).unwrap();
            array.write_box(&whole, &numbered(shape));
            let part = Box3::new([3, 5, 1], [37, 20, 18]);
            let mut out = vec![0.0; part.len()];
            array.read_box(&part, &mut out).unwrap();
            for (y, z) in part.rows() {
                for x in part.lo[0]..part.hi[0] {
                    assert_eq!(out[part.offset_of([x, y, z])], whole.offset_of([x, y, z]) as f32);
                }
            }
        }
    }

    #[test]
    fn the_window_bounds_what_is_resident() {
        let dir = tempfile::tempdir().unwrap();
        let scratch = Scratch::new(dir.path(), 4 << 20);
        let set = Arc::new(BrickSet::dense(BrickGrid::new([128, 128, 256], 32)));
        let array = BrickArray::<f32>::new(&scratch, &set).unwrap();
        for slot in 0..set.len() as Slot {
            array.write(slot, |b| b.fill(slot as f32));
            assert!(scratch.window.resident() <= 4 << 20);
        }
        for slot in 0..set.len() as Slot {
            array.read(slot, |b| assert!(b.iter().all(|&v| v == slot as f32)));
        }
        assert!(scratch.traffic().brick_loads >= 16, "the first bricks were dropped and loaded again");
        drop(array);
        assert_eq!(scratch.window.resident(), 0);
    }

    #[test]
    fn only_what_is_used_of_a_segment_counts() {
        let dir = tempfile::tempdir().unwrap();
        let scratch = Scratch::new(dir.path(), 4 << 20);
        let set = Arc::new(BrickSet::dense(BrickGrid::new([640, 64, 64], 64)));
        let array = BrickArray::<f32>::new(&scratch, &set).unwrap();
        for slot in [0, 2, 4, 6] {
            array.write(slot, |brick| brick.fill(1.0));
        }
        assert_eq!(scratch.window.resident(), 4 << 20, "a brick of each of four segments");
        assert_eq!(scratch.traffic().brick_loads, 4);
        array.write(1, |brick| brick.fill(1.0));
        assert!(scratch.window.resident() <= 4 << 20, "the other brick of the first segment");
        array.read(8, |brick| assert_eq!(brick[0], 0.0));
        drop(array);
        assert_eq!(scratch.window.resident(), 0);
    }

    #[test]
    fn absent_bricks_are_constant() {
        let dir = tempfile::tempdir().unwrap();
        let set = Arc::new(BrickSet::from_fn(BrickGrid::new([32, 16, 16], 16), |id| id == 0));
        let mut array = BrickArray::<f32>::new(&Scratch::new(dir.path(), 1 << 30), &set).unwrap();
        array.set_absent(1, 7.0);
        assert_eq!(array.constant_in(&Box3::new([16, 0, 0], [32, 16, 16])), Some(7.0));
        assert_eq!(array.constant_in(&Box3::new([15, 0, 0], [32, 16, 16])), None);
        let mut out = vec![0.0; 2];
        array.read_box(&Box3::new([15, 3, 3], [17, 4, 4]), &mut out).unwrap();
        assert_eq!(out, [0.0, 7.0]);
    }

    #[test]
    fn faces_are_the_outermost_valid_layers() {
        let dir = tempfile::tempdir().unwrap();
        let shape = [10, 8, 8];
        let set = Arc::new(BrickSet::dense(BrickGrid::new(shape, 8)));
        let array = BrickArray::<f32>::with_faces(&Scratch::new(dir.path(), 1 << 30), &set).unwrap();
        array.write_box(&Box3::from_shape(shape), &numbered(shape));
        array.refresh_faces(1);
        let value = |x: i64, y: i64, z: i64| Box3::from_shape(shape).offset_of([x, y, z]) as f32;
        array.read_face(1, FACES[1], |face| assert_eq!(face[3 * 8 + 2], value(9, 2, 3)));
        array.read_face(1, FACES[2], |face| assert_eq!(face[3 * 8 + 1], value(9, 0, 3)));
        array.read_face(1, FACES[5], |face| assert_eq!(face[2 * 8 + 1], value(9, 2, 7)));
    }
}
