//! Image terms and pictures: presmoothing, edge detector, pyramid, demo picture.

pub mod edge_detector;
pub mod heat;
