//! A piece of a solved field as it is read out: values, and what else was asked for, of its voxels.

use crate::grid::Box3;
use crate::kernel::distance::features::closest_point::ClosestPoints;

/// What is known of the voxels of a chunk, dense `[z][y][x]`; empty where nobody asked for it.
pub(super) struct Tile<'a, P> {
    pub(super) part: &'a Box3,
    pub(super) values: &'a [P],
    pub(super) sources: &'a [u32],
    pub(super) labels: &'a [u32],
    pub(super) borders: &'a [u32],
    pub(super) closest: &'a ClosestPoints<'a>,
}
