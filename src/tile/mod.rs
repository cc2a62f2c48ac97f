//! A field in memory: one brick grown by its halo, and reusable work buffers.

mod halo_tile;

pub use halo_tile::HaloTile;
