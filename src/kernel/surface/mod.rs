//! Surfaces: from a field to triangles, and what triangles measure (docs/algorithms.md, "Surfaces and measures").
//!
//! [`MarchingCubes`] turns a brick's voxels into a [`Patch`], [`Welder`] joins the patches into one mesh,
//! [`SurfaceMeasure`] sums volume and area as the triangles pass, [`PatchIndex`] answers how far points lie from them.

mod components;
mod contact;
mod corner;
mod creases;
mod edge_tally;
mod equidistant;
mod indicators;
mod interfaces;
pub(crate) mod known;
mod marching_cubes;
mod measure;
mod nearby;
mod nearest;
mod pairs;
mod partition;
mod polygon;
mod splits;
mod tables;
mod tetrahedron;
mod vertex_key;
mod weld;

pub use components::Components;
pub use contact::{Contact, Contacts};
pub use edge_tally::EdgeTally;
pub use equidistant::Between;
pub use interfaces::{Interfaces, TaggedPatch};
pub use known::Known;
pub use marching_cubes::{MarchingCubes, Patch, cells_of_brick};
pub use measure::{Measures, SurfaceMeasure};
pub use nearby::Nearby;
pub use nearest::{Hausdorff, Nearest, PatchIndex};
pub use pairs::{Pair, Pairs};
pub use partition::{Partition, REACH as PARTITION_REACH};
pub use vertex_key::VertexKey;
pub use weld::Welder;

pub use super::geometry::triangle::Triangle;
