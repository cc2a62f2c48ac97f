//! Pictures of slices.

pub mod palette;
pub mod panel;
