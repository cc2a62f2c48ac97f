//! Writes OME-Zarr 0.5 (Zarr version 3) stores: sharded multiscale images and labels; or 0.4 (Zarr version 2), unsharded.
//!
//! Rests on the OME-Zarr 0.4 and 0.5 specifications (`multiscales`, `omero`, `labels`, `image-label`) and the Zarr v3 core,
//! `sharding_indexed` and `blosc`, and Zarr v2 specifications. Arrays are `z, y, x`; lengths are physical.
//!
//! A [`StoreWriter`] builds the store under a hidden name beside its final one and moves it into place when all is
//! written; a live one stands there from the start. Shards are the unit of writing: each is encoded whole, by one caller, and appears under its name complete.

mod abandoned;
mod compression;
mod files;
mod level;
mod metadata;
mod place;
mod pyramid;
mod read;
mod root;
mod series;
mod shard;
mod store;
mod sums;
mod version;
mod written;

pub use abandoned::LONGEST_ENDING;
pub use compression::{Compression, Content};
pub use level::LevelWriter;
pub use metadata::{ImageSpec, LabelColor, LabelSpec};
pub use place::{GROWING, is_store};
pub use pyramid::{LevelPlan, plan_levels};
pub use read::{ImageReader, StoredLevel};
pub use root::{Live, LiveState, Root, live};
pub use series::{TIMES, TimeAxis, time_name};
pub use shard::{joined_bytes, shard_bytes};
pub use store::{ImageWriter, SharedStore, StoreWriter};
pub use sums::{CHECKSUMS, FileSum, first_misfit, listed_sums, store_files};
pub use version::OmeVersion;
