//! Filters and views of images: one method a file.

pub mod downsample;
pub mod palette;
pub mod panel;
