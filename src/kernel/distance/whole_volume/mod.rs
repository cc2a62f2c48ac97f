//! FMM and DP over a whole volume in memory, in the order of the textbook: one heap of voxels on trial.

pub mod dijkstra_heap;
pub mod marching_heap;
pub(crate) mod wavefront;
