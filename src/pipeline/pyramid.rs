//! Writes a field as a multiscale image: level 0 shard by shard from its source, each coarser level from the one
//! before.

use std::sync::Arc;

use crate::error::Result;
use crate::exec::{Engine, Stage, Workers, one_wave};
use crate::grid::{Box3, BrickGrid, BrickSet};
use crate::io::ome_zarr::LevelWriter;
use crate::kernel::image::downsample::{self, source_box};
use crate::store::{BoxSink, BoxSource, BrickArray, Element};

/// How several voxels become one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reduce {
    /// Their mean: intensities, distances, level sets.
    Mean,
    /// The most frequent one: labels.
    Mode,
}

/// Voxels along the edge of the bricks that coarser levels wait in.
const COARSE_EDGE: i64 = 64;

/// Fills all levels from `source`; returns the bytes written.
///
/// # Errors
/// When a shard cannot be written, scratch runs out or the run is interrupted.
pub fn write_levels<T: Element>(
    stage: &Stage<'_>,
    engine: &Engine,
    levels: &[LevelWriter],
    source: &dyn BoxSource<T>,
    reduce: Reduce,
) -> Result<u64> {
    let mut bytes = 0;
    let mut coarser: Option<BrickArray<T>> = None;
    for (n, level) in levels.iter().enumerate() {
        if n > 0 {
            let finer: &dyn BoxSource<T> = coarser.as_ref().map_or(source, |bricks| bricks);
            coarser = Some(coarsened(stage, engine, finer, level, reduce)?);
        }
        let source: &dyn BoxSource<T> = coarser.as_ref().map_or(source, |bricks| bricks);
        bytes += write_level(stage, level, source)?;
    }
    Ok(bytes)
}

fn write_level<T: Element>(stage: &Stage<'_>, level: &LevelWriter, source: &dyn BoxSource<T>) -> Result<u64> {
    let shards: Vec<Box3> = level.shards().collect();
    let written = stage.run(&shards, &Workers::none(), |(), shard| {
        if source.constant_in(shard) == Some(T::default()) {
            return Ok(0);
        }
        level.write_shard_with(shard, |part, out: &mut [T]| source.read_box(part, out))
    })?;
    Ok(written.iter().sum())
}

fn coarsened<T: Element>(
    stage: &Stage<'_>,
    engine: &Engine,
    finer: &dyn BoxSource<T>,
    level: &LevelWriter,
    reduce: Reduce,
) -> Result<BrickArray<T>> {
    let set = Arc::new(BrickSet::dense(BrickGrid::new(level.geometry().shape, COARSE_EDGE)));
    let bricks = BrickArray::new(engine.scratch(), &set)?;
    let factors = level.factors();
    stage.run(&one_wave(&set), &Workers::new(|| (Vec::new(), Vec::new())), |(fine, coarse), &slot| {
        let part = set.grid().brick_box(set.id(slot));
        let covered = source_box(&part, factors, finer.shape());
        fine.resize(covered.len(), T::default());
        coarse.resize(part.len(), T::default());
        finer.read_box(&covered, fine)?;
        match reduce {
            Reduce::Mean => downsample::mean(fine, covered.shape(), factors, coarse),
            Reduce::Mode => downsample::mode(fine, covered.shape(), factors, coarse),
        }
        bricks.write_box(&part, coarse)
    })?;
    Ok(bricks)
}
