//! What is known of the voxels of a box when the surfaces between its labels are drawn.

use super::nearby::Nearby;
use super::walls::Walls;
use crate::grid::{Box3, Geometry};
use crate::kernel::distance::features::labelled_shapes::LabelledShapes;
use crate::kernel::distance::features::source_trees::SourceTrees;

/// Voxels with the sources they track, over a box.
#[derive(Clone, Copy, Debug)]
pub struct Known<'a> {
    /// Where the voxels lie.
    pub geometry: &'a Geometry,
    /// What the sources are.
    pub shapes: &'a LabelledShapes<'a>,
    /// The nearest source of each label, near borders.
    pub nearby: &'a Nearby,
    /// The same anywhere.
    pub trees: &'a SourceTrees,
    /// The box.
    pub part: Box3,
    /// Source of each voxel, dense `[z][y][x]` over the box.
    pub sources: &'a [u32],
    /// Label of each voxel, that of its source.
    pub labels: &'a [u32],
    /// Of voxels of a label volume that touch.
    pub touching: Option<TouchingVoxels<'a>>,
}

/// Voxels of a label volume, whose labels meet half way where they touch and not where their sources are equally far.
#[derive(Clone, Copy, Debug)]
pub struct TouchingVoxels<'a> {
    /// Their own labels, dense over the same box; 0 for none.
    pub own: &'a [u32],
    /// Where two that touch meet.
    pub walls: &'a Walls,
}

impl Known<'_> {
    pub(crate) fn label(&self, voxel: [i64; 3]) -> u32 {
        self.labels[self.part.offset_of(voxel)]
    }

    /// The number of a label's source that is nearest to a place.
    pub(crate) fn nearest(&self, label: u32, place: [f64; 3]) -> u32 {
        let world = self.world(place);
        let near = self.nearby.nearest(self.shapes, self.trees, label, place, world);
        near.unwrap_or_else(|| self.trees.nearest(label, world))
    }

    pub(crate) fn world(&self, place: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|a| self.geometry.origin[a] + place[a] * self.geometry.spacing[a])
    }
}
