//! The distance methods: how a tile is relaxed. One file a method, and the solutions that methods share.

pub mod all_neighbours;
pub mod dijkstra_pythagoras;
pub mod fast_marching;
pub mod fast_sweeping;
pub mod shape_distance;
pub mod sweep_sources;
pub mod tracked;
pub mod upwind;
pub mod vector_distance;
