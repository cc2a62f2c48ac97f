//! `middle`: the surface equally far from labelled clouds and meshes, straight from source tracking (Kósa & Mikula
//! 2023; docs/algorithms.md, "Labels and middle surfaces").
//!
//! ```text
//! sources -> distance with tracking -> labels -> surfaces between them -> mesh, measures of each pair
//! ```
//!
//! Between labels of a volume that touch there is no gap to be in the middle of: walls pass between their voxels (`touching`), and where
//! a volume has nothing else, or surfaces against what has no label are asked for, these are all (`walls`).

mod assembled;
mod crowded;
mod draw;
#[cfg(test)]
mod ended;
mod exact;
mod job;
pub(crate) mod settings;
mod surface;
mod survey;
mod table;
mod touching;
mod walls;

pub(crate) use job::check_sets;
pub use job::{MiddleFound, MiddleSources, middle, middle_kept};
pub use settings::{LabelMode, MiddleSettings};
pub use surface::SurfaceKind;
pub use survey::Survey;
pub use touching::with_touching;
pub use walls::{WallsFound, WallsSettings, is_full, walls};
