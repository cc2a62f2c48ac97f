//! Meshes as they are written, while they are found.

mod body;
pub mod formats;
mod obj;
mod places;
pub mod ply;
mod spool;
mod stl;
mod temporary;
mod vtp;
