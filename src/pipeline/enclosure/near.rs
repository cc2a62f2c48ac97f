//! `Near`: the distance near a cloud, of which a rank of several has its part: its own cells, and the faces of those around them.

use super::far_regions::FarRegions;
use crate::grid::{BrickId, BrickSet};
use crate::store::BrickArray;

/// The distance within some reach of a cloud.
#[derive(Clone, Copy)]
pub struct Near<'a> {
    /// On this rank's part of the cells.
    pub distance: &'a BrickArray<f32>,
    /// The cells within the reach, of all ranks.
    pub cells: &'a BrickSet,
}

impl Near<'_> {
    /// The bricks beyond the reach.
    pub(super) fn far_regions(self) -> FarRegions {
        FarRegions::new(self.cells, self.distance.absent(0))
    }

    /// Their numbers, in order.
    pub(super) fn far_bricks(self) -> impl Iterator<Item = BrickId> {
        (0..self.cells.grid().len()).filter(move |&id| self.cells.slot(id).is_none())
    }
}
