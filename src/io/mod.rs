//! Which bytes mean what: one file format a file.

pub mod mesh_ply;
pub mod points;
pub mod tiff_stack;
