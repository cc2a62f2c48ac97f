//! The voxels that sources fix, brick by brick.

pub(crate) mod contiguous;
pub(crate) mod initialise;
pub mod label_borders;
pub(crate) mod outside;
pub(crate) mod sources;
