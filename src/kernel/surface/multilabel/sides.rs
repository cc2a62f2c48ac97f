//! `Sides`: what the surfaces between the labels of a volume are drawn from.

use crate::grid::Box3;

/// Who tells the labels of voxels, and where between two of them they meet.
pub trait Sides {
    /// Takes the labels, dense over `around`, of a box and what lies around it.
    fn enter(&mut self, labels: &[u32], around: &Box3, part: &Box3);

    /// Whether the box has one label only.
    fn is_one(&self) -> bool;

    /// The label at a place in the box.
    fn label(&self, at: usize) -> u32;

    /// The part of the way from one voxel to another beside it at which their labels meet.
    fn between(&self, ends: [[i64; 3]; 2], labels: [u32; 2]) -> f64;

    /// Where the volume ends, if surfaces are closed there: half a voxel beyond its last voxels.
    fn ends(&self) -> Option<&Box3> {
        None
    }

    /// Bytes of memory that stay between boxes.
    fn bytes(&self) -> u64;
}
