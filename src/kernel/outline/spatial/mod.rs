//! Sections in space: the function that they stand for, and how it is laid out on a grid.

pub mod cross_validation;
pub mod ends;
pub mod fitted;
pub mod lattice;
pub mod radial_basis;
pub(crate) mod residual;
pub mod samples;
pub mod shape;
pub mod windows;
