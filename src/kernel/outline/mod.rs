//! The shape that a few marked outlines stand for: planes, smooth closed curves through noisy marks, signed distances
//! in a plane, and one function in space that agrees with all of them.
//!
//! ```text
//! marks -> plane -> curve (noise estimated) -> section -> samples -> radial basis functions -> lattice -> shape
//! ```

pub mod planar;
pub mod spatial;
