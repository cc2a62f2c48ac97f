//! Which bytes: one format a file, no threads of its own.

pub mod ome_zarr;
pub mod png;
