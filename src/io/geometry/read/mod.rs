//! Points and meshes as they are read, told apart by content.

pub(crate) mod decoding;
pub(crate) mod ellipse;
pub(crate) mod foreign;
pub(crate) mod input;
pub(crate) mod mesh;
pub(crate) mod ply;
pub mod point_file;
pub mod point_units;
pub mod points;
pub(crate) mod roi;
pub(crate) mod single;
pub mod source;
pub mod sources;
