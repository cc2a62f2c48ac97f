//! Image terms, labels and pictures: grey range, presmoothing, edge detector, pyramid, slices with contours.

pub mod border_model;
pub mod box_gaussian;
pub mod carried;
pub mod downsample;
pub mod edge_detector;
pub mod extremes;
pub mod gaps;
pub mod gaussian;
pub mod geodesic;
pub mod grey_range;
pub mod heat;
pub mod histogram;
pub mod labels;
pub mod nearness;
pub mod palette;
pub mod panel;
pub mod profiles;
pub mod speed;
pub mod wall;
