//! Volumes in files: TIFF stacks and Zarr images.

pub mod formats;
pub mod label_volume;
mod number;
pub mod page_axes;
pub mod tiff;
pub(super) mod units;
pub mod volume;
pub mod zarr;
