//! Which bytes mean what: one file format a file.

pub mod mesh_ply;
pub mod ome_zarr;
pub mod png;
pub mod points;
pub mod tiff_stack;
