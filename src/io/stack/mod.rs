//! Volumes in files: TIFF stacks and Zarr images, NRRD and VTI.

pub mod formats;
pub mod interval;
pub mod label_volume;
mod number;
pub mod page_axes;
mod raw;
pub mod tiff;
pub(crate) mod units;
pub mod volume;
pub mod write;
pub mod zarr;

pub(crate) use raw::nrrd::file_of_voxels;
