//! A piece of a solved field as it is read out: values, and what else was asked for, of its voxels.

use crate::grid::Box3;
use crate::kernel::distance::features::closest_point::ClosestPoints;

/// What is known of the voxels of a chunk, dense `[z][y][x]`; empty where nobody asked for it.
pub(crate) struct Tile<'a, P> {
    pub(crate) part: &'a Box3,
    pub(crate) values: &'a [P],
    pub(crate) sources: &'a [u32],
    pub(crate) labels: &'a [u32],
    pub(crate) borders: &'a [u32],
    pub(crate) closest: &'a ClosestPoints<'a>,
}
