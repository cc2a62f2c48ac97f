//! Which voxels the sources of a distance fix: points, triangles, sources outside of the grid.

pub mod initialise;
pub mod outside;
pub(crate) mod outside_block;
pub mod seeds;
pub mod triangles;
