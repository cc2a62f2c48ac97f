//! What it takes to look for handles.

use crate::kernel::topology::blocks::LEN;

/// Bytes of a voxel in a block near the surface: its state, the name of its piece, and its place among those of its level.
const VOXEL_BYTES: u64 = 7;

/// Bytes of a point: its place.
const POINT_BYTES: u64 = 8;

/// Bytes of memory for so many blocks near the surface and so many points.
pub(crate) fn topology_bytes(blocks: u64, points: u64) -> u64 {
    blocks.saturating_mul(VOXEL_BYTES * LEN as u64).saturating_add(points.saturating_mul(POINT_BYTES))
}
