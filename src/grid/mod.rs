//! Integers, spacing, points and triangles: index arithmetic without any field data.
//!
//! Index and coordinate triples are `[x, y, z]` everywhere in the crate; arrays lie `[z][y][x]`, x fastest.
//! Indices are 64 bit: a product of extents may pass 2^31.

pub mod digits;

mod box3;
mod brick_grid;
mod brick_lists;
mod brick_set;
mod geometry;
mod mesh;
mod point_bins;
mod source_state;
mod sources;
mod stencil;
mod triangle_bins;
mod voxel_triangle;
mod weld;

pub use box3::Box3;
pub use brick_grid::{BrickGrid, BrickId};
pub use brick_set::{BrickSet, Slot};
pub use geometry::Geometry;
pub use mesh::{BoundaryEdges, MOST_SOURCES, TriangleMesh, refuse_too_many};
pub use point_bins::PointBins;
pub use source_state::{NO_SOURCE, SourceState};
pub use sources::{DataSets, PointCloud};
pub use stencil::{FACES, Face, NEIGHBOURS_26};
pub use triangle_bins::{TriangleBins, cells_beside};
pub use voxel_triangle::VoxelTriangle;
pub use weld::Weld;
