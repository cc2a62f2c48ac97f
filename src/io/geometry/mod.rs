//! Files of points and meshes.

pub mod read;
pub mod write;
