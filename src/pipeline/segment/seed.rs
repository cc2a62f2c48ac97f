//! An object without marks: it starts as a ball and goes where the image's edges and its curvature take it, the
//! segmentation that Kósa's begins with (Kósa 2015, Fig. 2.3). All of the image is solved, for it may go anywhere.

use std::sync::Arc;

use super::begun::Solution;
use super::begun::{Begun, Forces};
use super::picture::{Picture, name};
use super::settings::SegmentSettings;
use crate::error::Result;
use crate::exec::{Engine, Stage, Workers, one_wave};
use crate::grid::{BrickGrid, BrickSet, Geometry};
use crate::kernel::level_set::cell::CELL;
use crate::kernel::level_set::initial::ball;
use crate::pipeline::enclosure::needs::box_bytes;
use crate::pipeline::level_set::band::Band;
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
    stage.voxels(window.volume());
    let cells = BrickGrid::new(geometry.shape, CELL as i64).len();
    let held = engine.hold(box_bytes(0, cells, cells))?;
    let band = start_as_ball(&stage, engine, &geometry, seed)?;
    stage.finish();
    let forces = Forces::of_settings(settings);
    Begun { geometry, window, band, distance: None, cloud_points: 0, beta: 0.0, hole: None, rests: false, held }
        .solve(engine, picture, marks, settings, &forces)
}

/// A band of all voxels, which starts as the ball; no point pulls at it.
fn start_as_ball(stage: &Stage<'_>, engine: &Engine, geometry: &Geometry, seed: &Seed) -> Result<Band> {
    let grid = BrickGrid::new(geometry.shape, CELL as i64);
    let set = Arc::new(BrickSet::dense(grid));
    let u = BrickArray::<f32>::with_faces(engine.scratch(), &set)?;
    let solved = BrickArray::<u8>::new(engine.scratch(), &set)?;
    let distance = BrickArray::blank(engine.scratch(), &set, 0.0)?;
    stage.run(&one_wave(&set), &Workers::none(), |(), &slot| {
        let part = grid.brick_box(set.id(slot));
        u.write(slot, |u| {
            solved.write(slot, |solved| ball::start(geometry, &part, CELL, seed.centre, seed.radius, u, solved));
        });
        u.refresh_faces(slot);
        Ok(())
    })?;
    Ok(Band { u, distance, solved, voxels: geometry.domain().volume() })
}
