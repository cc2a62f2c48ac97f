//! Distance to points and triangles over a set of bricks (docs/algorithms.md, "Distance"): which voxels sources fix,
//! how distance is carried outward from them, and the fields that come of it.
//!
//! The set need not cover the domain: a value within the set's reach of the cloud is reached only through smaller
//! values, so leaving far bricks out changes none of the near ones.

mod checks;
mod costs;
mod exact;
mod job;
mod medium;
mod needs;
mod ranks;
pub mod readout;
pub mod schedule;
pub mod seeding;
mod solvers;
mod solving;
mod through;

use std::sync::Arc;

pub use checks::{check_iterations, check_timed_sources, outside_note, without_inside};
pub use job::{DistanceSettings, Init, distance, distance_kept, solve_sets, solve_sets_watched, travel_times};
pub use medium::Medium;
pub(crate) use needs::tree_bytes;
pub use needs::{Needs, Writes};
pub use ranks::{Reads, solve, solve_watched};
pub use readout::early::Early;
pub use readout::field::{DistanceWithSource, Solved};
pub use readout::found::DistanceFound;
pub(crate) use readout::images::Wanted;
pub use readout::kept::Kept;
pub(crate) use readout::reading::Reading;
pub(crate) use readout::visit::ReadOut;
pub use schedule::passing::Passed;
pub use seeding::sources::Sources;
pub use solvers::{Method, SOLVERS, Solver, Textbook, solvers};
pub use solving::Solving;

use crate::error::Result;
use crate::exec::{Engine, Stage, Workers, equal_part, one_wave, tell_faces};
use crate::grid::BrickSet;
use crate::kernel::distance::state::neighbours::Neighbours;
use crate::store::BrickArray;

/// In which order bricks are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Schedule {
    /// Bricks in the order in which distance reaches them, until nothing changes.
    Front,
    /// The textbook's order, bit for bit: ordered passes over all bricks, or one heap over the whole volume.
    Sweep {
        /// Of eight passes each; fewer when one changes nothing. A heap needs no second one.
        iterations: u32,
    },
}

/// What a method may do beside or instead of the usual.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// As far as that, physical units; voxels farther away count as that far.
    pub farthest: f64,
    /// Whose sources a voxel is offered, with methods that take all 26.
    pub neighbours: Neighbours,
    /// Sources too, with methods that can do without.
    pub sources: bool,
    /// Sources stand for the labels of their data sets: of equally near ones those of the lowest label count.
    pub labels: bool,
}

impl Options {
    /// Distances up to that one, no more.
    #[must_use]
    pub fn up_to(farthest: f64) -> Self {
        Self { farthest, neighbours: Neighbours::Faces, sources: false, labels: false }
    }
}

/// Distance to the nearest point in f32, physical units, on this rank's equal part of the bricks of `set`, with the faces of ghosts; no value
/// above `farthest`. No bit depends on threads or ranks.
///
/// # Errors
/// When scratch runs out, the run is interrupted or another rank is gone.
pub fn cloud_distance(
    stage: &Stage<'_>,
    engine: &Engine,
    sources: &Sources<'_>,
    set: &BrickSet,
    method: Method,
    farthest: f32,
) -> Result<BrickArray<f32>> {
    let options = Options::up_to(f64::from(farthest));
    let solved = ranks::solve_once::<f32>(stage, sources, set, (method, Schedule::Front), options, Reads::default())?;
    let own = &Arc::new(equal_part(stage.comm(), set));
    let mut distance = BrickArray::with_faces(engine.scratch(), own)?;
    let (edge, len) = (set.grid().edge(), set.grid().brick_len());
    let workers = Workers::new(move || vec![0.0; len]);
    stage.run(&one_wave(own), &workers, |values, &slot| {
        let part = set.grid().brick_box(own.id(slot));
        solved.values.read_box(&part, &mut values[..part.len()])?;
        distance.write(slot, |brick| {
            let width = part.shape()[0] as usize;
            for (row, (y, z)) in part.rows().enumerate() {
                let to = (((z - part.lo[2]) * edge + y - part.lo[1]) * edge) as usize;
                brick[to..][..width].copy_from_slice(&values[row * width..][..width]);
            }
        });
        distance.refresh_faces(slot);
        Ok(())
    })?;
    distance.set_all_absent(farthest);
    tell_faces(stage.comm(), &distance)?;
    Ok(distance)
}
