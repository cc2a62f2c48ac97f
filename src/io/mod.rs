//! Which bytes mean what: one file format a file.

pub mod geometry;
pub mod ome_zarr;
pub mod png;
pub mod stack;
mod text;
