//! Labels without a wrong one: where the nearest source may belong to another set than the tracked one, it is looked up.
//!
//! The distance to a set changes by no more than the way one goes. So where, at the middle of a box of voxels, one set is
//! nearer than all others by twice the box's half diagonal, all of the box is its own; other boxes are halved. Only near
//! the borders of labels this goes down to voxels, and only voxels whose label changes are remembered.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::error::Result;
use crate::exec::{Stage, Workers};
use crate::grid::{Box3, BrickGrid, BrickId, DataSets, Geometry};
use crate::kernel::distance::source_trees::SourceTrees;
use crate::store::BoxSource;

/// Sources, with others where the tracked ones have the wrong label.
struct Corrected<'a> {
    tracked: Arc<dyn BoxSource<u32> + Send + 'a>,
    grid: BrickGrid,
    /// Voxels and their sources, by brick.
    changes: BTreeMap<BrickId, Vec<([i64; 3], u32)>>,
}

impl BoxSource<u32> for Corrected<'_> {
    fn shape(&self) -> [i64; 3] {
        self.tracked.shape()
    }

    fn read_box(&self, part: &Box3, out: &mut [u32]) -> Result<()> {
        self.tracked.read_box(part, out)?;
        for (voxel, source) in self.grid.bricks_in(part).filter_map(|id| self.changes.get(&id)).flatten() {
            if (0..3).all(|a| (part.lo[a]..part.hi[a]).contains(&voxel[a])) {
                out[part.offset_of(*voxel)] = *source;
            }
        }
        Ok(())
    }
}

/// The tracked sources with those of the wrong label replaced by the nearest.
pub(super) fn exact_sources<'a>(
    stage: &Stage<'_>,
    geometry: &Geometry,
    sets: &DataSets,
    trees: &SourceTrees,
    grid: &BrickGrid,
    tracked: Arc<dyn BoxSource<u32> + Send + 'a>,
) -> Result<Arc<dyn BoxSource<u32> + Send + 'a>> {
    let bricks: Vec<BrickId> = (0..grid.len()).collect();
    let workers = Workers::new(Vec::new);
    let changes = stage.run(&bricks, &workers, |sources, &id| {
        let part = grid.brick_box(id);
        sources.resize(part.len(), 0);
        tracked.read_box(&part, sources)?;
        Ok(trees.corrections(geometry, sets, &part, sources))
    })?;
    let changes = bricks.into_iter().zip(changes).filter(|(_, changes)| !changes.is_empty()).collect();
    Ok(Arc::new(Corrected { tracked, grid: *grid, changes }))
}
