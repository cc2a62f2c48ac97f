//! Surfaces: from a field to triangles, and what triangles measure (algorithms: section "Surface and measures").
//!
//! [`MarchingCubes`] turns a brick's voxels into a [`Patch`], [`Welder`] joins the patches into one mesh,
//! [`SurfaceMeasure`] sums volume and area as the triangles pass, [`PatchIndex`] answers how far points lie from them.

mod components;
mod edge_key;
mod edge_tally;
mod marching_cubes;
mod measure;
mod nearest;
mod tables;
mod weld;

pub use components::Components;
pub use edge_key::{EdgeKey, EdgeKeys};
pub use edge_tally::EdgeTally;
pub use marching_cubes::{MarchingCubes, Patch, cells_of_brick};
pub use measure::{Measures, SurfaceMeasure};
pub use nearest::{Hausdorff, Nearest, PatchIndex};
pub use weld::Welder;

pub use crate::kernel::triangle::Triangle;
