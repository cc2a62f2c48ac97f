//! What a solved distance showed: its largest values, and voxels that nothing reached.

use std::collections::BTreeMap;

/// What a job found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DistanceFound {
    /// The largest distance.
    pub max: f64,
    /// Voxels that sources fixed.
    pub fixed_voxels: u64,
    /// Voxels that no source reached.
    pub unlabelled_voxels: u64,
    /// Distances from a voxel to a triangle that were computed to fix voxels, where there are triangles.
    pub triangle_distances: Option<u64>,
    /// Voxels of each label, where labels were asked for; also of labels that are nowhere the nearest.
    pub label_voxels: BTreeMap<u32, u64>,
}
