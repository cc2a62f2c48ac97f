//! What a repair looks at: a box of a finished field, with the sources that its voxels have.

use crate::grid::{Box3, DataSets, Geometry};
use crate::kernel::distance::features::source_trees::SourceTrees;

/// The voxels that are looked at, and what is known of them and of those around.
#[derive(Clone, Copy, Debug)]
pub struct RepairBox<'a> {
    /// The grid.
    pub geometry: &'a Geometry,
    /// The voxels that are looked at.
    pub part: &'a Box3,
    /// `part` with [`MARGIN`] voxels more on every side, as far as the grid goes.
    pub known: &'a Box3,
    /// The sources of `known`, dense `[z][y][x]`.
    pub found: &'a [u32],
    /// The farthest distance that counts, where sources may have been lost: voxels a spacing beyond are not looked at.
    /// Sources were carried [`REACH`] voxels farther.
    pub lost_within: Option<f64>,
    /// What decides on labels, where there are several.
    pub labels: Option<Labels<'a>>,
}

impl RepairBox<'_> {
    /// Voxels are looked at whose squared distance is below that.
    pub(super) fn counts_below(&self) -> f64 {
        self.lost_within.map_or(f64::INFINITY, |farthest| (farthest + self.geometry.max_spacing()).powi(2))
    }
}

/// What decides on labels.
#[derive(Clone, Copy, Debug)]
pub struct Labels<'a> {
    /// The data sets of the sources.
    pub sets: &'a DataSets,
    /// The same, sorted, where sources may have been lost.
    pub trees: Option<&'a SourceTrees>,
}
