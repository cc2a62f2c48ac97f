//! An engine with scratch of its own, fields made of plain vectors, and a plain grid to compare them with.

use std::sync::Arc;

use strandline::exec::{Budget, Cancel, Engine, Silent};
use strandline::grid::{Box3, BrickGrid, BrickSet, Slot};
use strandline::kernel::level_set::cell::CELL;
use strandline::pipeline::level_set::band::Band;
use strandline::store::{BoxSource, BrickArray, Element, Scratch};

/// An engine, and the folder it works in for as long as it lives.
pub(crate) struct Lab {
    pub(crate) engine: Engine,
    pub(crate) _folder: tempfile::TempDir,
}

impl Lab {
    pub(crate) fn new(threads: usize) -> Self {
        Self::with_window(threads, 1 << 30)
    }

    /// At most so many bytes of fields are resident.
    pub(crate) fn with_window(threads: usize, window: u64) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scratch = Scratch::new(folder.path(), window);
        let budget = Budget { total: 2 << 30 };
        let engine = Engine::new(threads, scratch, budget, Cancel::default(), Arc::new(Silent)).expect("threads start");
        Self { engine, _folder: folder }
    }

    /// A field with the given values, `[z][y][x]` over the whole grid, on the bricks of `set`.
    pub(crate) fn field<T: Element>(&self, set: &Arc<BrickSet>, values: &[T]) -> BrickArray<T> {
        let field = BrickArray::with_faces(self.engine.scratch(), set).expect("room for a field");
        field.write_box(&Box3::from_shape(set.grid().shape()), values);
        (0..set.len() as Slot).for_each(|slot| field.refresh_faces(slot));
        field
    }
}

impl Lab {
    /// A band over all cells of a domain, made of plain fields.
    pub(crate) fn band(&self, shape: [i64; 3], u: &[f32], d: &[f32], solved: &[u8]) -> Band {
        let set = dense(shape, CELL as i64);
        Band {
            u: self.field(&set, u),
            distance: self.field(&set, d),
            solved: self.field(&set, solved),
            voxels: solved.iter().map(|s| u64::from(*s)).sum(),
        }
    }
}

/// All bricks of a domain.
pub(crate) fn dense(shape: [i64; 3], edge: i64) -> Arc<BrickSet> {
    Arc::new(BrickSet::dense(BrickGrid::new(shape, edge)))
}

/// All values of a field, `[z][y][x]` over the whole grid.
pub(crate) fn whole<T: Element>(field: &BrickArray<T>) -> Vec<T> {
    let part = Box3::from_shape(BoxSource::shape(field));
    let mut values = vec![T::default(); part.len()];
    field.read_box(&part, &mut values).expect("memory can be read");
    values
}

/// A plain grid of voxels: index arithmetic of its own, mirrored beyond its border.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlainGrid {
    pub(crate) shape: [i64; 3],
}

impl PlainGrid {
    pub(crate) fn len(self) -> usize {
        self.shape.iter().product::<i64>() as usize
    }

    /// All voxels, x fastest: in the order of their places.
    pub(crate) fn voxels(self) -> impl Iterator<Item = [i64; 3]> {
        let [nx, ny, nz] = self.shape;
        (0..nz).flat_map(move |z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])))
    }

    pub(crate) fn contains(self, v: [i64; 3]) -> bool {
        (0..3).all(|a| v[a] >= 0 && v[a] < self.shape[a])
    }

    /// The place of a voxel; beyond the border that of the nearest voxel inside.
    pub(crate) fn at(self, v: [i64; 3]) -> usize {
        let [x, y, z]: [i64; 3] = std::array::from_fn(|a| v[a].clamp(0, self.shape[a] - 1));
        (x + self.shape[0] * (y + self.shape[1] * z)) as usize
    }

    /// The voxels across -x, +x, -y, +y, -z, +z, whether inside or not.
    pub(crate) fn around([x, y, z]: [i64; 3]) -> [[i64; 3]; 6] {
        [[x - 1, y, z], [x + 1, y, z], [x, y - 1, z], [x, y + 1, z], [x, y, z - 1], [x, y, z + 1]]
    }
}
