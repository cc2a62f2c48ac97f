//! The start of a distance: the voxels that sources fix. Only bricks that hold such voxels are written; all others
//! stay unknown and cost nothing until a front reaches them.

use crate::error::Result;
use crate::exec::{Stage, Workers};
use crate::grid::{NO_SOURCE, Slot, SourceState};
use crate::kernel::distance::methods::shape_distance::ShapeDistance;
use crate::kernel::distance::seeding::initialise::fix_voxels;
use crate::kernel::distance::seeding::seeds::{Seeds, write_states};
use crate::kernel::distance::seeding::triangles;
use crate::kernel::distance::state::method::DistanceState;
use crate::pipeline::distance::Sources;
use crate::pipeline::distance::medium::{Medium, time_squared};
use crate::store::BrickArray;

/// At most so far beyond the voxels that a point fixes others are told of it, in voxels: what that costs grows with it.
const FARTHEST_TOLD: i64 = 4;

/// How far beyond the voxels that a point fixes others are told of it, along each axis: a point of another cell can be
/// nearer than the one that fixes a voxel, but no farther than a cell's diagonal. With equal spacings 1.
///
/// It lets fixed voxels start from the nearest point of all. And a point whose voxels are all nearer to others would
/// else be walled in by them, and nobody beyond would ever hear of it.
fn trial_margin(spacing: [f64; 3]) -> [i64; 3] {
    let diagonal = spacing.iter().map(|h| h * h).sum::<f64>().sqrt();
    spacing.map(|h| ((diagonal / h).ceil().min(1e3) as i64 - 1).clamp(1, FARTHEST_TOLD))
}

/// Whether voxels beside those that a point fixes are told of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Start {
    /// Only fixed voxels know of a source, as the textbook has it.
    Fixed,
    /// Where a method keeps sources, voxels beside them too; and of all these points a fixed voxel has the nearest,
    /// also one that does not fix it.
    Provisional,
}

/// What the sources made of this rank's bricks.
pub(crate) struct Seeded {
    /// The bricks that know of a source, in order of their slots.
    pub(crate) bricks: Vec<Slot>,
    pub(crate) fixed_voxels: u64,
    /// Distances from a voxel to a triangle that were computed.
    pub(crate) triangle_distances: u64,
}

/// Fixes voxels of this rank's bricks; `kept`, where it is given, gets the sources that fix them. Sources
/// outside of the grid fix none that is farther than `farthest` and some voxels more.
pub(crate) fn initialise<M: DistanceState>(
    stage: &Stage<'_>,
    sources: &Sources<'_>,
    array: &BrickArray<M::State>,
    kept: Option<&BrickArray<SourceState>>,
    (start, farthest): (Start, f64),
) -> Result<Seeded> {
    let set = array.set();
    let (grid, len) = (*set.grid(), set.grid().brick_len());
    let spreads = start == Start::Provisional && M::trial(0).is_some();
    let margin = if spreads { trial_margin(sources.geometry.spacing) } else { [0; 3] };
    let near: Vec<Slot> = set.owned().filter(|&slot| sources.may_seed(set.id(slot), margin)).collect();
    let workers = Workers::new(move || (Seeds::new(len), Seeds::new(if spreads { len } else { 0 })));
    let counts = stage.run(&near, &workers, |(fixed, told), &slot| {
        let id = set.id(slot);
        let (part, edge) = (grid.brick_box(id), grid.edge() as usize);
        fixed.clear();
        told.clear();
        let points = sources.points_seeding(id, [0; 3]);
        fix_voxels(sources.geometry, &part, edge, points, &mut fixed.squared, &mut fixed.source);
        let label = |source| sources.sets.map_or(0, |sets| sets.label(source));
        let mut distances = 0;
        if let Some((mesh, bins)) = sources.mesh {
            let first = sources.positions.len() as u32;
            let beside = bins.of(id).iter().map(|&n| (first + n, mesh.corners(n as usize)));
            let (squared, source) = (&mut fixed.squared, &mut fixed.source);
            distances = triangles::fix_voxels(sources.geometry, &part, edge, beside, label, squared, source);
        }
        if let Some(outside) = sources.outside {
            // Distances up to there are made of those of voxels beside the way, which may be a little larger.
            let beside = sources.geometry.length([2; 3]);
            outside.fix_voxels(&part, edge, farthest + beside, fixed);
        }
        if let Some(medium) = sources.medium {
            turn_into_times(medium, slot, fixed);
        }
        if spreads {
            let points = sources.points_seeding(id, margin);
            fix_voxels(sources.geometry, &part, edge, points, &mut told.squared, &mut told.source);
        }
        let (count, known) = (fixed.count(), fixed.count() + told.count());
        if known > 0 {
            array.write(slot, |out| write_states::<M>(fixed, told, label, out));
            array.refresh_faces(slot);
        }
        if let Some(kept) = kept.filter(|_| count > 0) {
            kept.write(slot, |out| write_states::<ShapeDistance<'_>>(fixed, told, label, out));
            kept.refresh_faces(slot);
        }
        Ok((count, known, distances))
    })?;
    let known = near.into_iter().zip(&counts).filter(|(_, (_, known, _))| *known > 0);
    Ok(Seeded {
        bricks: known.map(|(slot, _)| slot).collect(),
        fixed_voxels: counts.iter().map(|(fixed, _, _)| fixed).sum(),
        triangle_distances: counts.iter().map(|(_, _, distances)| distances).sum(),
    })
}

/// Makes the distances of fixed voxels the times that these take at the voxels' own speeds; what nothing passes is not fixed.
fn turn_into_times(medium: &Medium, slot: Slot, fixed: &mut Seeds) {
    medium.of(slot, |speeds| {
        for ((squared, source), &speed) in fixed.squared.iter_mut().zip(&mut fixed.source).zip(speeds) {
            if *source != NO_SOURCE {
                *squared = time_squared(*squared, speed);
            }
            if speed == 0.0 {
                *source = NO_SOURCE;
            }
        }
    });
}
