//! The label volume on its way into a store, and how many voxels each label has.

use std::collections::BTreeMap;

use super::early::Early;
use super::image::{begin_image, type_for};
use crate::error::Result;
use crate::exec::{Comm, Engine, Stage, Workers, gather_records};
use crate::grid::{Box3, BrickGrid, Geometry};
use crate::io::ome_zarr::{ImageWriter, StoreWriter};
use crate::kernel::image::labels;
use crate::pipeline::output::pyramid::{Reduce, write_levels};
use crate::pipeline::segment::neighbours::Joined;
use crate::store::{BoxSource, Element, ElementType};

/// Writes what is not written of the labels, and counts their voxels. The type of the image is that for the highest label of all
/// objects, solved or not: so all times of a series have one.
pub(crate) fn write_labels(
    engine: &Engine,
    geometry: &Geometry,
    (volume, highest): (&Joined<'_>, u32),
    solved: &[u32],
    (store, early): (Option<&StoreWriter>, Option<&dyn Early>),
) -> Result<BTreeMap<u32, u64>> {
    let stage = engine.resumable_stage("write labels", 0);
    stage.voxels(geometry.domain().volume());
    match (store, early) {
        (_, Some(early)) => early.finish(&stage, engine, volume)?,
        (Some(store), None) => {
            let labels = || solved.iter().copied();
            match type_for(highest) {
                ElementType::U8 => {
                    write_as::<u8>(&stage, engine, begin_image::<u8>(store, geometry, labels())?, volume)
                }
                ElementType::U16 => {
                    write_as::<u16>(&stage, engine, begin_image::<u16>(store, geometry, labels())?, volume)
                }
                _ => write_as::<u32>(&stage, engine, begin_image::<u32>(store, geometry, labels())?, volume),
            }?;
        }
        (None, None) => {}
    }
    let counts = count_labels(&stage, engine.comm(), geometry, volume)?;
    stage.finish();
    Ok(counts)
}

fn write_as<T: Element>(stage: &Stage<'_>, engine: &Engine, image: ImageWriter, volume: &Joined<'_>) -> Result<()> {
    write_levels::<T>(stage, engine, image, volume, Reduce::Mode)
}

/// Voxels of each label; each rank counts in its share of the grid.
fn count_labels(
    stage: &Stage<'_>,
    comm: &dyn Comm,
    geometry: &Geometry,
    volume: &Joined<'_>,
) -> Result<BTreeMap<u32, u64>> {
    let grid = BrickGrid::new(geometry.shape, 64);
    let share = |rank: usize| grid.len() * rank as u64 / comm.ranks() as u64;
    let parts: Vec<Box3> = (share(comm.rank())..share(comm.rank() + 1)).map(|id| grid.brick_box(id)).collect();
    let counts = stage.run(&parts, &Workers::new(Vec::new), |labels, part| {
        if BoxSource::<u32>::constant_in(volume, part) == Some(0) {
            return Ok(BTreeMap::new());
        }
        labels.resize(part.len(), 0);
        volume.read_box(part, labels)?;
        Ok(labels::count(labels))
    })?;
    let own = summed(counts.into_iter().flatten());
    if comm.ranks() == 1 {
        return Ok(own);
    }
    Ok(summed(gather_records(comm, &own)?.into_iter().flatten()))
}

fn summed(counts: impl Iterator<Item = (u32, u64)>) -> BTreeMap<u32, u64> {
    counts.fold(BTreeMap::new(), |mut all, (label, n)| {
        *all.entry(label).or_default() += n;
        all
    })
}
