//! A field on disk: bricks in memory-mapped scratch files, and the traits by which boxes of voxels are read and
//! written.

mod both_sinks;
mod brick_array;
pub mod checkpoint;
mod element;
mod free_space;
mod hidden;
mod mapped;
mod scratch;
mod slot_file;
mod spill;
mod stream;
mod unfinished;
mod window;
mod writeback;

pub use both_sinks::BothSinks;
pub use brick_array::BrickArray;
pub use element::{Element, ElementType, Sample, SampleWork, SamplesMut};
pub use free_space::free_space;
pub use hidden::{HiddenFile, HiddenFolder};
pub use scratch::Scratch;
pub use spill::{Spill, Spilled};
pub use stream::{BoxSource, MeshSink, NoMesh, PlaneSource, VolumeSource, Whereabouts};
pub use unfinished::{Unfinished, remove_all as remove_unfinished};
pub use window::{Traffic, Window};
pub use writeback::begin_writeback;
