//! Distance to sources, one tile at a time: which voxels sources fix, how methods carry distance outward, which source a
//! voxel has, and what a solved field is read as.
//!
//! From below: `state`; `tile_order` and `features`; `seeding`; `methods`; `whole_volume`, `tracking` and `repair`.

pub mod features;
pub mod methods;
pub mod repair;
pub mod seeding;
pub mod state;
pub mod tile_order;
pub mod tracking;
pub mod whole_volume;
