//! The shape that a few marked outlines stand for: planes, smooth closed curves through noisy marks, signed distances
//! in a plane, and one function in space that agrees with all of them.
//!
//! ```text
//! marks -> plane -> curve (noise estimated) -> section -> samples -> radial basis function -> lattice -> shape
//! ```

use crate::grid::Box3;

pub mod cross_validation;
pub mod crossing;
pub mod curve;
pub mod lattice;
pub mod noise;
pub mod plane;
pub mod radial_basis;
pub mod samples;
pub mod section;
pub mod shape;

/// Copies the dense values of a box, shorter than a brick where the domain ends, into a brick of an edge.
pub fn spread<T: Copy>(values: &[T], part: &Box3, edge: usize, brick: &mut [T]) {
    let [width, height, _] = part.shape().map(|n| n as usize);
    for (row, values) in values.chunks_exact(width).enumerate() {
        let (y, z) = (row % height, row / height);
        brick[(z * edge + y) * edge..][..width].copy_from_slice(values);
    }
}
