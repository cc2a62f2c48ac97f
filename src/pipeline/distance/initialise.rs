//! The start of a distance: the voxels that sources fix. Only bricks that hold such voxels are written; all others
//! stay unknown and cost nothing until a front reaches them.

use super::Sources;
use crate::error::Result;
use crate::exec::{Stage, Workers};
use crate::grid::Slot;
use crate::kernel::distance::initialise::{NO_SOURCE, fix_voxels};
use crate::kernel::distance::method::DistanceMethod;
use crate::kernel::distance::shape_distance::ShapeDistance;
use crate::kernel::distance::triangles;
use crate::store::BrickArray;

/// How far beyond the voxels that a point fixes others are told of it, in voxels. A point whose voxels are all nearer to
/// other points would else be walled in by them, and nobody beyond would ever hear of it.
const TOLD: i64 = 1;

/// Whether voxels beside those that a point fixes are told of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Start {
    /// Only fixed voxels know of a source, as the textbook has it.
    Fixed,
    /// Voxels beside them too, where a method keeps sources.
    Told,
}

/// What sources make of one brick.
struct Seeds {
    squared: Vec<f64>,
    source: Vec<u32>,
}

impl Seeds {
    fn new(len: usize) -> Self {
        Self { squared: vec![f64::INFINITY; len], source: vec![NO_SOURCE; len] }
    }

    fn clear(&mut self) {
        self.squared.fill(f64::INFINITY);
        self.source.fill(NO_SOURCE);
    }

    fn count(&self) -> u64 {
        self.source.iter().filter(|&&s| s != NO_SOURCE).count() as u64
    }
}

/// Fixes voxels of this rank's bricks; `kept`, where it is given, gets the sources that fix them. Returns the bricks that
/// know of a source, in order of their slots, and the number of fixed voxels.
pub(super) fn initialise<M: DistanceMethod>(
    stage: &Stage<'_>,
    sources: &Sources<'_>,
    array: &BrickArray<M::State>,
    kept: Option<&BrickArray<u32>>,
    start: Start,
) -> Result<(Vec<Slot>, u64)> {
    let set = array.set();
    let (grid, len) = (*set.grid(), set.grid().brick_len());
    let tells = start == Start::Told && M::told(0).is_some();
    let margin = if tells { TOLD } else { 0 };
    let near: Vec<Slot> = set.owned().filter(|&slot| sources.may_seed(set.id(slot), margin)).collect();
    let workers = Workers::new(move || (Seeds::new(len), Seeds::new(if tells { len } else { 0 })));
    let counts = stage.run(&near, &workers, |(fixed, told), &slot| {
        let id = set.id(slot);
        let (part, edge) = (grid.brick_box(id), grid.edge() as usize);
        fixed.clear();
        told.clear();
        let points = sources.points_seeding(id, 0);
        fix_voxels(sources.geometry, &part, edge, points, &mut fixed.squared, &mut fixed.source);
        if let Some((mesh, bins)) = sources.mesh {
            let first = sources.positions.len() as u32;
            let beside = bins.of(id).iter().map(|&n| (first + n, mesh.corners(n as usize)));
            triangles::fix_voxels(sources.geometry, &part, edge, beside, &mut fixed.squared, &mut fixed.source);
        }
        if tells {
            let points = sources.points_seeding(id, margin);
            fix_voxels(sources.geometry, &part, edge, points, &mut told.squared, &mut told.source);
        }
        let (count, known) = (fixed.count(), fixed.count() + told.count());
        if known > 0 {
            array.write(slot, |out| write_seeds::<M>(fixed, told, out));
            array.refresh_faces(slot);
        }
        if let Some(kept) = kept.filter(|_| count > 0) {
            kept.write(slot, |out| write_seeds::<ShapeDistance<'_>>(fixed, told, out));
            kept.refresh_faces(slot);
        }
        Ok((count, known))
    })?;
    let start = near.into_iter().zip(&counts).filter(|(_, (_, known))| *known > 0).map(|(slot, _)| slot).collect();
    Ok((start, counts.iter().map(|(count, _)| count).sum()))
}

fn write_seeds<M: DistanceMethod>(fixed: &Seeds, told: &Seeds, out: &mut [M::State]) {
    for (out, (&squared, &source)) in out.iter_mut().zip(fixed.squared.iter().zip(&fixed.source)) {
        *out = if source == NO_SOURCE { M::UNKNOWN } else { M::fixed(squared, source) };
    }
    for (out, &source) in out.iter_mut().zip(&told.source) {
        if source != NO_SOURCE && !M::is_fixed(*out) {
            *out = M::told(source).unwrap_or(*out);
        }
    }
}
