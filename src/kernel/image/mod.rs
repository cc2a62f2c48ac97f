//! Image terms and pictures: presmoothing, edge detector, pyramid, slices with contours.

pub mod downsample;
pub mod edge_detector;
pub mod heat;
pub mod palette;
pub mod panel;
