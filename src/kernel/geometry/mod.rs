//! Triples, triangles and closed meshes: geometry in f64, without a grid.

pub(crate) mod eigen;
pub mod nearest_point;
pub mod rim;
pub mod solid;
pub mod triangle;
pub(crate) mod vector;
pub mod winding_number;
