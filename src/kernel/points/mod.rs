//! Clouds without a grid: what the points around a place tell of the surface there.

pub mod bridge;
pub mod facing;
pub mod height_field;
pub mod local_fit;
pub mod orientation;
pub mod rim;
pub mod smoothing;
pub mod surfel;
