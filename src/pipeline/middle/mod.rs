//! `middle`: the surface equally far from labelled clouds and meshes, straight from source tracking (Kósa & Mikula
//! 2023; docs/algorithms.md, "Labels and middle surfaces").
//!
//! ```text
//! sources -> distance with tracking -> labels -> surfaces between them -> mesh, measures of each pair
//! ```

mod assembled;
mod crowded;
#[cfg(test)]
mod ended;
mod exact;
mod job;
pub(crate) mod settings;
mod surface;
mod table;

pub(crate) use job::check_sets;
pub use job::{MiddleFound, middle, middle_kept};
pub use settings::{LabelMode, MiddleSettings};
pub use surface::SurfaceKind;
