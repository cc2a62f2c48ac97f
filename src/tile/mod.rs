//! A field in memory: one brick grown by its halo, and reusable work buffers.

mod cost;
mod halo_tile;

pub use cost::TileCost;
pub use halo_tile::HaloTile;
