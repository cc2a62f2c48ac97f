//! The jobs as a Rust program states them: builders that take sources and settings, refuse what makes no sense before
//! anything is computed, and return results as values.
//!
//! ```text
//! points, meshes, volumes -> builder -> checks -> pipeline -> fields that are read by boxes, labels, meshes, measures
//! ```

pub(crate) mod disk;
mod distance_field;
mod field;
mod given;
pub(crate) mod live;
mod mesh;
mod middle_surface;
mod motion;
mod reconstruction;
pub(crate) mod resources;
mod run;
mod segmentation;
mod task;
mod volume;
mod words;

pub use distance_field::{DistanceField, SolvedDistance};
pub use field::Field;
pub use mesh::LabelledMesh;
pub use middle_surface::{MiddleSurface, SolvedMiddle};
pub use reconstruction::{Reconstruction, SolvedReconstruction};
pub use segmentation::{Segmentation, SolvedSegmentation};
pub use volume::Volume;
