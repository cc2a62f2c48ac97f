//! Image terms, labels and pictures: grey range, presmoothing, edge detector, pyramid, slices with contours.

pub mod border;
pub mod difference;
pub mod filter;
pub mod grey;
pub mod labels;
pub mod morphology;
pub mod picture;
pub mod shift;
