//! In which order the voxels of a tile are visited, and which visits can be left out.

pub mod arrival;
pub(crate) mod buckets;
pub(crate) mod diagonals;
pub(crate) mod directions;
pub(crate) mod dirty;
