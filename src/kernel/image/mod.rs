//! Image terms, labels and pictures: grey range, presmoothing, edge detector, pyramid, slices with contours.

pub mod border_model;
pub mod downsample;
pub mod edge_detector;
pub mod gaussian;
pub mod grey_range;
pub mod heat;
pub mod histogram;
pub mod labels;
pub mod palette;
pub mod panel;
pub mod profiles;
pub mod speed;
