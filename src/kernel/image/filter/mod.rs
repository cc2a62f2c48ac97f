//! Filters: smoothing, edges, fewer voxels.

pub mod box_gaussian;
pub mod downsample;
pub mod edge_detector;
pub mod gaussian;
pub mod heat;
