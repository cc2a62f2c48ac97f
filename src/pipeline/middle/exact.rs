//! Labels without a wrong one: where the nearest source belongs to another set than the tracked one
//! (`kernel::distance::features::exact_labels`), it is put in its place as voxels are read.
//!
//! Only voxels whose label changes are remembered. Distances are lowered to those of their new sources.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::error::Result;
use crate::exec::{Hold, Stage, Workers};
use crate::grid::{Box3, BrickGrid, BrickId};
use crate::kernel::distance::features::exact_sources::ExactSources;
use crate::kernel::distance::state::precision::Precision;
use crate::pipeline::distance::{DistanceWithSource, Solved};
use crate::store::BoxSource;

/// A solved distance, with other sources where the tracked ones have the wrong label.
struct Corrected<'a, P> {
    values: Arc<dyn BoxSource<P> + Send + 'a>,
    sources: Arc<dyn BoxSource<u32> + Send + 'a>,
    with_source: Option<Arc<dyn DistanceWithSource<P> + Send + 'a>>,
    grid: BrickGrid,
    /// By brick.
    changes: BTreeMap<BrickId, Vec<Change>>,
    /// What they take of the memory: how many voxels have the wrong label, only the run tells.
    _held: Hold,
}

/// A voxel, its nearest source and how far that is.
struct Change {
    voxel: [i64; 3],
    source: u32,
    distance: f64,
}

impl<P: Precision> Corrected<'_, P> {
    /// The changes in a box, each with its place in it.
    fn within<'a>(&'a self, part: &'a Box3) -> impl Iterator<Item = (usize, &'a Change)> {
        let changes = self.grid.bricks_in(part).filter_map(|id| self.changes.get(&id)).flatten();
        let inside = |change: &&Change| (0..3).all(|a| (part.lo[a]..part.hi[a]).contains(&change.voxel[a]));
        changes.filter(inside).map(|change| (part.offset_of(change.voxel), change))
    }

    fn lower(&self, part: &Box3, values: &mut [P]) {
        for (at, change) in self.within(part) {
            values[at] = P::from_f64(values[at].to_f64().min(change.distance));
        }
    }

    fn replace(&self, part: &Box3, sources: &mut [u32]) {
        for (at, change) in self.within(part) {
            sources[at] = change.source;
        }
    }
}

impl<P: Precision> BoxSource<P> for Corrected<'_, P> {
    fn shape(&self) -> [i64; 3] {
        self.grid.shape()
    }

    fn read_box(&self, part: &Box3, out: &mut [P]) -> Result<()> {
        self.values.read_box(part, out)?;
        self.lower(part, out);
        Ok(())
    }
}

impl<P: Precision> BoxSource<u32> for Corrected<'_, P> {
    fn shape(&self) -> [i64; 3] {
        self.grid.shape()
    }

    fn read_box(&self, part: &Box3, out: &mut [u32]) -> Result<()> {
        self.sources.read_box(part, out)?;
        self.replace(part, out);
        Ok(())
    }
}

impl<P: Precision> DistanceWithSource<P> for Corrected<'_, P> {
    fn read_both(&self, part: &Box3, values: &mut [P], sources: &mut [u32]) -> Result<()> {
        if let Some(with_source) = &self.with_source {
            with_source.read_both(part, values, sources)?;
        } else {
            self.values.read_box(part, values)?;
            self.sources.read_box(part, sources)?;
        }
        self.lower(part, values);
        self.replace(part, sources);
        Ok(())
    }
}

/// A solved distance with the sources of the wrong label replaced by the nearest, in the bricks that are read.
///
/// # Errors
/// When what is remembered does not fit the memory, or the run is interrupted.
pub(super) fn with_exact_labels<'a, P: Precision>(
    stage: &Stage<'_>,
    exact: &ExactSources<'_>,
    (grid, bricks): (&BrickGrid, Vec<BrickId>),
    solved: Solved<'a, P>,
) -> Result<Solved<'a, P>> {
    let workers = Workers::new(Vec::new);
    // As of tracked sources: what is at the limit is beyond it.
    let limit = P::from_f64(exact.farthest);
    let changes = stage.run(&bricks, &workers, |sources, &id| {
        let part = grid.brick_box(id);
        sources.resize(part.len(), 0);
        solved.sources.read_box(&part, sources)?;
        let change = |(voxel, source)| {
            let distance = exact.shapes.distance(exact.geometry.position(voxel), source);
            Change { voxel, source, distance }
        };
        let counts = |change: &Change| P::from_f64(change.distance) < limit;
        Ok(exact.corrections(&part, sources).into_iter().map(change).filter(counts).collect::<Vec<_>>())
    })?;
    let bytes = changes.iter().map(|changes| (changes.capacity() * size_of::<Change>()) as u64).sum();
    let held = stage.hold(bytes)?;
    let changes: BTreeMap<_, _> = bricks.into_iter().zip(changes).filter(|(_, changes)| !changes.is_empty()).collect();
    let Solved { values, sources, with_source, .. } = solved;
    let corrected = Arc::new(Corrected { values, sources, with_source, grid: *grid, changes, _held: held });
    Ok(Solved { values: corrected.clone(), sources: corrected.clone(), with_source: Some(corrected), ..solved })
}
