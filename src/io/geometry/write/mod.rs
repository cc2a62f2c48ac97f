//! Meshes as they are written.

pub mod export;
pub mod ply;
