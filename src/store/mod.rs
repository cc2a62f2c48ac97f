//! A field on disk: bricks in memory-mapped scratch files, and the traits by which boxes of voxels are read and written.

mod element;
mod stream;

pub use element::{Element, ElementType, SamplesMut};
pub use stream::{BoxSink, BoxSource, MeshBuffer, MeshSink, PlaneSource};
