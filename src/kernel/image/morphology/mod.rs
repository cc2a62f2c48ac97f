//! Distances within an image: to sets of voxels, around gaps, along walls.

pub mod gaps;
pub mod geodesic;
pub mod nearness;
