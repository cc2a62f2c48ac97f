//! Clouds without a grid: what the points around a place tell of the surface there.

pub mod height_field;
pub mod orientation;
pub mod smoothing;
