//! Surfaces: from a field to triangles, and what triangles measure (docs/algorithms.md, "Surfaces and measures").
//!
//! [`MarchingCubes`] turns a brick's voxels into a [`Patch`], [`Welder`] joins the patches into one mesh,
//! [`SurfaceMeasure`] sums volume and area as the triangles pass, [`PatchIndex`] answers how far points lie from them.

pub mod cubes;
pub mod mesh;
pub mod multilabel;

pub use cubes::marching_cubes::{MarchingCubes, cells_of_brick, fraction};
pub use cubes::surroundings::{Surroundings, outward, surroundings};
pub use mesh::clustering::{Clustered, Clustering};
pub use mesh::components::Components;
pub use mesh::edge_tally::EdgeTally;
pub use mesh::growing::Growing;
pub use mesh::measure::{Measures, SurfaceMeasure};
pub use mesh::nearest::{Hausdorff, Nearest, PatchIndex};
pub use mesh::patch::Patch;
pub use mesh::spread::Spread;
pub use mesh::vertex_key::VertexKey;
pub use mesh::weld::Welder;
pub use multilabel::equidistant::Between;
pub use multilabel::indicators::Indicators;
pub use multilabel::interfaces::{Interfaces, TaggedPatch};
pub use multilabel::known::{Known, TouchingVoxels};
pub use multilabel::measured::bending::{Bending, Bendings};
pub use multilabel::measured::contact::{Contact, Contacts};
pub use multilabel::measured::label_measures::{LabelMeasures, label_measures};
pub use multilabel::measured::pairs::{Facet, Pair, Pairs};
pub use multilabel::nearby::Nearby;
pub use multilabel::partition::{Partition, REACH as PARTITION_REACH};
pub use multilabel::sides::Sides;
pub use multilabel::walls::Walls;

pub use super::geometry::triangle::Triangle;
