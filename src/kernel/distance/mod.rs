//! Distance to point sources on one tile: where sources fix voxels, and how sweeps carry them outward.

mod buckets;
mod diagonals;
pub mod dijkstra_pythagoras;
mod directions;
pub mod fast_marching;
pub mod fast_sweeping;
pub mod initialise;
pub mod method;
pub mod precision;
pub mod shape_distance;
pub mod tracked;
pub mod triangles;
pub mod vector_distance;
pub mod winding_number;

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
