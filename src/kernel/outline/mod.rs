//! The shape that a few marked outlines stand for: planes, smooth closed curves through noisy marks, signed distances
//! in a plane, and one function in space that agrees with all of them.
//!
//! ```text
//! marks -> plane -> curve (noise estimated) -> section -> samples -> radial basis functions -> lattice -> shape
//! ```

pub mod chords;
pub mod cross_validation;
pub mod crossing;
pub mod curve;
pub mod ends;
pub mod fitted;
pub mod lattice;
pub mod marked;
pub mod noise;
pub mod plane;
pub mod radial_basis;
mod residual;
pub mod samples;
pub mod section;
pub mod shape;
pub mod windows;
