//! An object without marks: it starts as a ball and goes where the image's edges and its curvature take it, the
//! segmentation that Kósa's begins with (Kósa 2015, Fig. 2.3). All of the image is solved, for it may go anywhere.

use std::sync::Arc;

use super::object::{Picture, Solution, edge_field, name};
use super::settings::SegmentSettings;
use crate::error::Result;
use crate::exec::{Engine, Workers, one_wave};
use crate::grid::{BrickGrid, BrickSet, Geometry};
use crate::kernel::level_set::CELL;
use crate::pipeline::band::Band;
use crate::pipeline::evolve::evolve;
use crate::pipeline::marks::{ObjectMarks, Seed};
use crate::store::{BrickArray, Element};

/// Solves an object that starts as a ball.
pub(super) fn grow<T: Element>(
    engine: &Engine,
    picture: &Picture<'_, T>,
    marks: &ObjectMarks,
    seed: &Seed,
    settings: &SegmentSettings,
) -> Result<Solution> {
    let geometry = picture.geometry.clone();
    let window = geometry.domain();
    let stage = engine.stage(&name("seed", marks), 0);
    let mut band = ball(engine, &geometry, seed)?;
    stage.voxels(band.voxels);
    stage.run(&one_wave(band.solved.set()), &Workers::none(), |(), &slot| {
        band.u.refresh_faces(slot);
        Ok(())
    })?;
    stage.finish();
    let edge_field = edge_field(engine, picture, marks, settings, &geometry, window, &band)?;
    let stage = engine.stage(&name("level set", marks), 0);
    stage.voxels(band.voxels);
    let time_loop = settings.motion.time_loop(&geometry);
    let evolution = evolve(&stage, engine, &mut band, edge_field.as_ref(), geometry.spacing, &time_loop)?;
    stage.finish();
    let Band { u, distance, voxels: band_voxels, .. } = band;
    Ok(Solution { geometry, window, u, distance, cloud_points: 0, beta: 0.0, hole: None, band_voxels, evolution })
}

/// A band of all voxels, which starts as the ball; no point pulls at it.
fn ball(engine: &Engine, geometry: &Geometry, seed: &Seed) -> Result<Band> {
    let grid = BrickGrid::new(geometry.shape, CELL as i64);
    let set = Arc::new(BrickSet::dense(grid));
    let u = BrickArray::<f32>::with_faces(engine.scratch(), &set)?;
    let solved = BrickArray::<u8>::new(engine.scratch(), &set)?;
    let distance = BrickArray::blank(engine.scratch(), &set, 0.0)?;
    let edge = grid.edge();
    for slot in one_wave(&set) {
        engine.check()?;
        let part = grid.brick_box(set.id(slot));
        let place = |[x, y, z]: [i64; 3]| (((z - part.lo[2]) * edge + y - part.lo[1]) * edge + x - part.lo[0]) as usize;
        let voxels = || part.rows().flat_map(|(y, z)| (part.lo[0]..part.hi[0]).map(move |x| [x, y, z]));
        u.write(slot, |u| {
            for voxel in voxels() {
                let at = geometry.position(voxel);
                let squared: f64 = (0..3).map(|a| (at[a] - seed.centre[a]).powi(2)).sum();
                u[place(voxel)] = if squared <= seed.radius * seed.radius { 1.0 } else { 0.0 };
            }
        });
        solved.write(slot, |solved| voxels().for_each(|voxel| solved[place(voxel)] = 1));
    }
    Ok(Band { u, distance, solved, voxels: geometry.domain().volume() })
}
