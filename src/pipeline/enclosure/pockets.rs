//! Pockets: what a ball of some radius cannot reach that rolls around the cloud from outside (the complement of the
//! closing of Edelsbrunner & Mücke's alpha shapes, on the grid). An open body's bell is one, and so is every dent.
//!
//! Where the flood from outside reaches at that radius, the ball's centre may be; pockets are farther than the radius
//! from there and not reached themselves.

use super::near::Near;
use super::needs::POINT_BYTES;
use super::tagging::level_of;
use super::watershed::WALL_VOXELS;
use crate::error::Result;
use crate::exec::{Boundary, Engine, HaloPlan, Hold, Reach, Stage, Workers, join_records, one_wave};
use crate::grid::{Geometry, PointBins};
use crate::kernel::level_set::initial::flood::shore;
use crate::kernel::level_set::initial::pocket;
use crate::kernel::level_set::initial::pocket::Ball;
use crate::pipeline::distance::{Method, Sources, cloud_distance};
use crate::store::BrickArray;
use crate::tile::HaloTile;

/// So many largest spacings beyond the ball begin what counts: its surface lies between voxels.
const SLACK_VOXELS: f64 = 1.0;

/// How deep each voxel lies in a pocket of a ball of that radius, 0 for those in none; physical lengths, over the cells
/// of `near`, which reaches farther than the radius. What is `inside` anyhow is no pocket, nor are walls of points.
///
/// # Errors
/// When scratch runs out or the run is interrupted.
pub(crate) fn pockets(
    stage: &Stage<'_>,
    engine: &Engine,
    geometry: &Geometry,
    near: Near<'_>,
    inside: &BrickArray<u8>,
    radius: f64,
) -> Result<BrickArray<f32>> {
    let (distance, set) = (near.distance, near.distance.set());
    let level = level_of(stage, engine, near)?;
    let (centres, _held) = centres(stage, engine, geometry, &level, radius as f32)?;
    let bins = PointBins::new(*set.grid(), geometry, &centres);
    let sources = Sources::cloud(geometry, &centres, &bins);
    let away = cloud_distance(stage, engine, &sources, near.cells, Method::VDT, f32::INFINITY)?;
    let ball = Ball {
        radius: radius as f32,
        from: (radius + SLACK_VOXELS * geometry.max_spacing()) as f32,
        wall: (WALL_VOXELS * geometry.min_spacing()) as f32,
    };
    stage.run(&one_wave(set), &Workers::none(), |(), &slot| {
        let known = |d: &[f32], level: &[f32], inside: &[u8]| {
            away.write(slot, |away| pocket::depth(ball, d, level, inside, away));
        };
        distance.read(slot, |d| level.read(slot, |level| inside.read(slot, |inside| known(d, level, inside))));
        Ok(())
    })?;
    Ok(away)
}

/// The outermost places that the ball's centre may be at, and what holds the memory that they take.
fn centres(
    stage: &Stage<'_>,
    engine: &Engine,
    geometry: &Geometry,
    level: &BrickArray<f32>,
    radius: f32,
) -> Result<(Vec<[f64; 3]>, Vec<Hold>)> {
    let set = level.set();
    let plan = HaloPlan::new(*set.grid(), Reach::Faces);
    let edge = set.grid().edge() as usize;
    let found = stage.run(&one_wave(set), &Workers::new(move || HaloTile::new(edge)), |tile, &slot| {
        plan.gather(level, slot, Boundary::Constant(f32::INFINITY), tile);
        let lo = set.grid().brick_box(set.id(slot)).lo;
        let place = |at: [usize; 3]| geometry.position(std::array::from_fn(|a| lo[a] + at[a] as i64));
        let centres: Vec<_> = shore(tile, radius).into_iter().map(place).collect();
        let held = engine.hold(centres.len() as u64 * POINT_BYTES)?;
        Ok((centres, held))
    })?;
    let (found, mut held): (Vec<_>, Vec<_>) = found.into_iter().unzip();
    let own = found.concat();
    let own_count = own.len();
    let (centres, _) = join_records(stage.comm(), own)?;
    held.push(engine.hold((centres.len() - own_count) as u64 * POINT_BYTES)?);
    Ok((centres, held))
}
