//! The start of a distance: the voxels that sources fix. Only bricks that hold such voxels are written; all others
//! stay unknown and cost nothing until a front reaches them.

use super::Sources;
use crate::error::Result;
use crate::exec::{Stage, Workers};
use crate::grid::Slot;
use crate::kernel::distance::initialise::{NO_SOURCE, fix_voxels};
use crate::kernel::distance::method::DistanceMethod;
use crate::kernel::distance::triangles;
use crate::store::BrickArray;

/// Fixes voxels of this rank's bricks; returns the bricks that hold any, in order of their slots, and the number of
/// fixed voxels.
pub(super) fn initialise<M: DistanceMethod>(
    stage: &Stage<'_>,
    sources: &Sources<'_>,
    array: &BrickArray<M::State>,
) -> Result<(Vec<Slot>, u64)> {
    let set = array.set();
    let (grid, len) = (*set.grid(), set.grid().brick_len());
    let near: Vec<Slot> = set.owned().filter(|&slot| sources.may_fix(set.id(slot))).collect();
    let workers = Workers::new(move || (vec![0.0; len], vec![0; len]));
    let fixed = stage.run(&near, &workers, |(squared, source), &slot| {
        let id = set.id(slot);
        let (part, edge) = (grid.brick_box(id), grid.edge() as usize);
        squared.fill(f64::INFINITY);
        source.fill(NO_SOURCE);
        fix_voxels(sources.geometry, &part, edge, sources.points_fixing(id), squared, source);
        if let Some((mesh, bins)) = sources.mesh {
            let first = sources.positions.len() as u32;
            let beside = bins.of(id).iter().map(|&n| (first + n, mesh.corners(n as usize)));
            triangles::fix_voxels(sources.geometry, &part, edge, beside, squared, source);
        }
        let count = source.iter().filter(|&&s| s != NO_SOURCE).count() as u64;
        if count > 0 {
            array.write(slot, |out| {
                for (out, (&squared, &source)) in out.iter_mut().zip(squared.iter().zip(source.iter())) {
                    *out = if source == NO_SOURCE { M::UNKNOWN } else { M::fixed(squared, source) };
                }
            });
            array.refresh_faces(slot);
        }
        Ok(count)
    })?;
    let start = near.into_iter().zip(&fixed).filter(|(_, count)| **count > 0).map(|(slot, _)| slot).collect();
    Ok((start, fixed.iter().sum()))
}
