//! Meshes as they are written, while they are found.

pub mod again;
mod body;
pub mod formats;
mod obj;
mod places;
pub mod ply;
pub mod precomputed;
mod spool;
mod stl;
mod temporary;
mod vtp;
