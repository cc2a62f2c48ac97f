//! What solving a surface takes for each voxel near the cloud, each cell, point and thread: what estimates are made of.

use crate::pipeline::level_set::evolve::KEPT_LAYERS;

/// Scratch a voxel near the cloud takes while its surface is solved: two time levels, distance and edges, f32 with
/// faces (3/8 more), flags, and what the time loop keeps of it. Presmoothing before that takes less, though it reaches
/// a cell farther.
pub(crate) const SOLVE_BYTES: u64 = 24 + 4 * KEPT_LAYERS as u64;
/// Scratch a voxel near the cloud takes for the distance alone: state and result, with faces.
pub(crate) const DISTANCE_BYTES: u64 = 11;
/// What stays of it when the surface is solved.
pub(crate) const KEPT_BYTES: u64 = 6;
/// Memory a cell takes whether stored or not: constant values and slots of all fields, bins.
pub(crate) const GRID_CELL_BYTES: u64 = 80;
/// Memory a stored cell takes beside its scratch: locks, waves, sums; its part of the mesh's bookkeeping.
pub(crate) const STORED_CELL_BYTES: u64 = 1200;
/// Memory a point of the cloud takes: its position, twice, and its place in the bins.
pub(crate) const POINT_BYTES: u64 = 64;
/// Buffers of one thread for cells and for patches of the surface; presmoothing by the default width takes no more.
pub(crate) const THREAD_BYTES: u64 = 4 << 20;
/// Voxels a thread holds to make a brick of a coarser level, and a chunk of a shard.
pub(crate) const COARSE_VOXELS: u64 = 128 * 128 * 128 + 4 * 64 * 64 * 64;
/// Seconds of one thread for a voxel near the cloud.
pub(crate) const SECONDS_PER_NEAR_VOXEL: f64 = 2.5e-6;

/// Bytes of memory that the box around a cloud of so many points holds while its surface is solved on so many of its cells.
pub(crate) fn box_bytes(points: u64, grid_cells: u64, stored: u64) -> u64 {
    let of_cells = grid_cells.saturating_mul(GRID_CELL_BYTES).saturating_add(stored.saturating_mul(STORED_CELL_BYTES));
    points.saturating_mul(POINT_BYTES).saturating_add(of_cells)
}
