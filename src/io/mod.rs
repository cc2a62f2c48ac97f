//! Which bytes mean what: one file format a file.

mod decoding;
pub(crate) mod ellipse;
mod foreign;
mod input;
pub mod label_volume;
mod mesh;
pub mod mesh_export;
pub mod mesh_ply;
pub mod ome_zarr;
pub mod page_axes;
mod ply;
pub mod png;
pub mod point_file;
pub mod point_units;
pub mod points;
mod roi;
mod single;
pub mod source;
pub mod sources;
pub mod stack;
pub mod stacks;
mod text;
pub mod tiff_stack;
pub(super) mod units;
pub mod zarr_image;
