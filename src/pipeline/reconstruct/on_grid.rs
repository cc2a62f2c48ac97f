//! What was solved on a box of a grid, read on the whole grid: beyond the box lies one value, and what the box has beyond
//! the grid is left out.

use crate::error::Result;
use crate::grid::Box3;
use crate::store::{BoxSource, BrickArray};

/// A field of a box, as a field of the grid that it was cut out of.
pub(super) struct OnGrid<'a> {
    pub(super) field: &'a BrickArray<f32>,
    /// The box in voxels of the grid; may reach past it.
    pub(super) window: Box3,
    /// Of the grid.
    pub(super) shape: [i64; 3],
    /// What is beyond the box.
    pub(super) beyond: f32,
}

impl OnGrid<'_> {
    /// A part of the grid, as far as the box has it: in voxels of the grid, and of the box.
    fn known(&self, part: &Box3) -> (Box3, Box3) {
        let known = part.intersect(&self.window);
        let own = |corner: [i64; 3]| std::array::from_fn(|a| corner[a] - self.window.lo[a]);
        (known, Box3 { lo: own(known.lo), hi: own(known.hi) })
    }
}

impl BoxSource<f32> for OnGrid<'_> {
    fn shape(&self) -> [i64; 3] {
        self.shape
    }

    fn read_box(&self, part: &Box3, out: &mut [f32]) -> Result<()> {
        let (known, own) = self.known(part);
        if known == *part {
            return self.field.read_box(&own, out);
        }
        out.fill(self.beyond);
        if known.is_empty() {
            return Ok(());
        }
        let mut values = vec![0.0; own.len()];
        self.field.read_box(&own, &mut values)?;
        let width = own.shape()[0] as usize;
        for (row, (y, z)) in values.chunks_exact(width).zip(known.rows()) {
            out[part.offset_of([known.lo[0], y, z])..][..width].copy_from_slice(row);
        }
        Ok(())
    }

    fn constant_in(&self, part: &Box3) -> Option<f32> {
        let (known, own) = self.known(part);
        if known.is_empty() {
            return Some(self.beyond);
        }
        let value = self.field.constant_in(&own)?;
        (known == *part || value.to_bits() == self.beyond.to_bits()).then_some(value)
    }
}
