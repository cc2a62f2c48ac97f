//! The front of a wavefront method over a whole volume in memory: one heap of the voxels on trial (Kósa & Mikula 2023,
//! Alg. 4 and 5; docs/algorithms.md, "Distance").
//!
//! The smallest voxel leaves first; of equal ones that of the lower place. A voxel whose value falls is put in once
//! more, and its older entries are passed over. Scratch: one byte a voxel and 16 for each entry.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use crate::grid::Box3;

/// A volume's voxels on trial, and those that are frozen.
#[derive(Debug)]
pub(crate) struct Wavefront {
    domain: Box3,
    frozen: Vec<bool>,
    /// The bits of the value, which are ordered like values that are not negative, and the place.
    heap: BinaryHeap<Reverse<(u64, u64)>>,
}

impl Wavefront {
    /// For a dense `[z][y][x]` volume of that shape.
    pub(crate) fn new(shape: [i64; 3]) -> Self {
        let domain = Box3::from_shape(shape);
        Self { domain, frozen: vec![false; domain.len()], heap: BinaryHeap::new() }
    }

    /// Puts a voxel on trial at a value that is not negative.
    pub(crate) fn push(&mut self, place: usize, value: f64) {
        self.heap.push(Reverse((value.abs().to_bits(), place as u64)));
    }

    /// Freezes the smallest voxel on trial; returns its place.
    pub(crate) fn freeze(&mut self) -> Option<usize> {
        loop {
            let Reverse((_, place)) = self.heap.pop()?;
            let place = place as usize;
            if !std::mem::replace(&mut self.frozen[place], true) {
                return Some(place);
            }
        }
    }

    pub(crate) fn is_frozen(&self, place: usize) -> bool {
        self.frozen[place]
    }

    pub(crate) fn voxel(&self, place: usize) -> [i64; 3] {
        let [nx, ny, _] = self.domain.hi.map(|n| n as usize);
        [place % nx, place / nx % ny, place / nx / ny].map(|n| n as i64)
    }

    /// The place of the voxel at `offset` from another, where it lies in the domain.
    pub(crate) fn beside(&self, voxel: [i64; 3], offset: [i64; 3]) -> Option<usize> {
        let beside = std::array::from_fn(|a| voxel[a] + offset[a]);
        self.domain.contains(beside).then(|| self.domain.offset_of(beside))
    }
}
