//! Distance to point sources on one tile: where sources fix voxels, and how sweeps carry them outward.

pub mod all_neighbours;
pub(crate) mod beside_sources;
mod buckets;
pub mod closest_point;
pub mod culling;
mod diagonals;
pub mod dijkstra_heap;
pub mod dijkstra_pythagoras;
mod directions;
mod distinct;
mod due;
pub mod exact_labels;
pub mod extent;
pub mod fast_marching;
pub mod fast_sweeping;
pub mod initialise;
pub mod inside;
mod label_borders;
pub mod labelled_shapes;
pub mod leaving;
pub mod marching_heap;
pub mod method;
pub mod outside;
mod outside_block;
pub mod parents;
pub mod precision;
pub mod second_look;
pub mod seeds;
pub mod shape_distance;
pub mod source_trees;
pub mod sweep_sources;
pub mod trace;
pub mod tracked;
pub mod triangles;
pub mod upwind;
pub mod vector_distance;
mod wavefront;
pub mod winding_number;

use crate::grid::{FACES, NEIGHBOURS_26};

/// The eight sweep orders: for each axis, whether it runs from low to high; x changes fastest.
pub const SWEEPS: [[bool; 3]; 8] = {
    let mut orders = [[true; 3]; 8];
    let mut n = 0;
    while n < 8 {
        orders[n] = [n & 1 == 0, n & 2 == 0, n & 4 == 0];
        n += 1;
    }
    orders
};

/// The neighbours whose sources a voxel is offered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Neighbours {
    /// The six that share a face with it.
    #[default]
    Faces,
    /// All 26.
    All,
}

impl Neighbours {
    /// The steps to them: -x, +x, -y, +y, -z, +z, or all 26, z slowest.
    #[must_use]
    pub fn offsets(self) -> Vec<[i64; 3]> {
        match self {
            Self::Faces => FACES.iter().map(|face| face.offset()).collect(),
            Self::All => NEIGHBOURS_26.to_vec(),
        }
    }
}
