//! Distance to a point cloud over a set of bricks, by ordered sweeps (algorithms: sections 2 and 3).
//!
//! The set need not cover the domain: a value within the set's reach of the cloud is reached only through smaller
//! values, so leaving far bricks out changes none of the near ones.

use std::sync::Arc;

use crate::error::Result;
use crate::exec::{Boundary, Engine, HaloPlan, Reach, Stage, Workers, one_wave, sweep_waves};
use crate::grid::{BrickSet, Geometry, PointBins, Slot};
use crate::kernel::distance::{SWEEPS, fast_sweeping, initialise, vector_distance};
use crate::store::{BrickArray, Element};
use crate::tile::HaloTile;

/// How distance is carried outward.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Fast sweeping: the Eikonal equation.
    Fsm,
    /// Vector distance transform: exact Euclidean distance to a tracked source.
    Vdt,
}

/// One row of [`SOLVERS`].
#[derive(Clone, Copy, Debug)]
pub struct Solver {
    /// What `--method` calls it.
    pub name: &'static str,
    /// One line for the help.
    pub about: &'static str,
    /// The method.
    pub method: Method,
}

/// The distance methods, in the order in which the help lists them.
pub const SOLVERS: &[Solver] = &[
    Solver { name: "fsm", about: "fast sweeping, the Eikonal equation", method: Method::Fsm },
    Solver { name: "vdt", about: "vector distance transform, Euclidean to a tracked source", method: Method::Vdt },
];

/// A cloud on a grid: what every distance method starts from.
pub struct Sources<'a> {
    /// The grid that the cloud lies on.
    pub geometry: &'a Geometry,
    /// World positions of the points.
    pub positions: &'a [[f64; 3]],
    /// The points by brick.
    pub bins: &'a PointBins,
}

/// Distance to the nearest point in f32, physical units, on the bricks of `set`, no value above `farthest`.
///
/// # Errors
/// When scratch runs out or the run is interrupted.
pub fn cloud_distance(
    stage: &Stage<'_>,
    engine: &Engine,
    sources: &Sources<'_>,
    set: &Arc<BrickSet>,
    method: Method,
    farthest: f32,
) -> Result<BrickArray<f32>> {
    let mut distance = match method {
        Method::Fsm => fast_sweeping_distance(stage, engine, sources, set, farthest)?,
        Method::Vdt => vector_distance(stage, engine, sources, set, farthest)?,
    };
    for id in 0..set.grid().len() {
        distance.set_absent(id, farthest);
    }
    Ok(distance)
}

fn fast_sweeping_distance(
    stage: &Stage<'_>,
    engine: &Engine,
    sources: &Sources<'_>,
    set: &Arc<BrickSet>,
    farthest: f32,
) -> Result<BrickArray<f32>> {
    let mut distance = BrickArray::with_faces(engine.scratch(), set)?;
    initialise(stage, sources, &distance, |squared, source| match source {
        initialise::NO_SOURCE => f32::INFINITY,
        _ => fast_sweeping::fixed(squared.sqrt() as f32),
    })?;
    let spacing = sources.geometry.spacing;
    sweep_all(stage, &mut distance, f32::INFINITY, |tile, _, upward| fast_sweeping::sweep(tile, spacing, upward))?;
    stage.run(&one_wave(set), &Workers::none(), |(), &slot| {
        distance.write(slot, |d| d.iter_mut().for_each(|d| *d = d.abs().min(farthest)));
        distance.refresh_faces(slot);
        Ok(())
    })?;
    Ok(distance)
}

fn vector_distance(
    stage: &Stage<'_>,
    engine: &Engine,
    sources: &Sources<'_>,
    set: &Arc<BrickSet>,
    farthest: f32,
) -> Result<BrickArray<f32>> {
    let mut state = BrickArray::with_faces(engine.scratch(), set)?;
    initialise(stage, sources, &state, |_, source| match source {
        initialise::NO_SOURCE => source,
        _ => source | vector_distance::FIXED,
    })?;
    let (geometry, positions) = (sources.geometry, sources.positions);
    sweep_all(stage, &mut state, initialise::NO_SOURCE, |tile, part, upward| {
        vector_distance::sweep(tile, geometry, part, positions, upward)
    })?;
    let distance = BrickArray::with_faces(engine.scratch(), set)?;
    let edge = set.grid().edge();
    stage.run(&one_wave(set), &Workers::none(), |(), &slot| {
        let part = set.grid().brick_box(set.id(slot));
        state.read(slot, |state| {
            distance.write(slot, |d: &mut [f32]| {
                for (y, z) in part.rows() {
                    let row = (((z - part.lo[2]) * edge + y - part.lo[1]) * edge) as usize;
                    for x in part.lo[0]..part.hi[0] {
                        let at = row + (x - part.lo[0]) as usize;
                        let source = vector_distance::source_of(state[at]);
                        d[at] = if source == initialise::NO_SOURCE {
                            farthest
                        } else {
                            let here = geometry.position([x, y, z]);
                            let squared = initialise::squared_distance(here, positions[source as usize]);
                            (squared.sqrt() as f32).min(farthest)
                        };
                    }
                }
            });
        });
        distance.refresh_faces(slot);
        Ok(())
    })?;
    Ok(distance)
}

/// Gives every brick its start values: `value(squared distance, source)` for each voxel.
fn initialise<T: Element>(
    stage: &Stage<'_>,
    sources: &Sources<'_>,
    array: &BrickArray<T>,
    value: impl Fn(f64, u32) -> T + Sync,
) -> Result<()> {
    let set = array.set();
    let (grid, len) = (*set.grid(), set.grid().brick_len());
    let workers = Workers::new(move || (vec![0.0; len], vec![0; len]));
    stage.run(&one_wave(set), &workers, |(squared, source), &slot| {
        let id = set.id(slot);
        squared.fill(f64::INFINITY);
        source.fill(initialise::NO_SOURCE);
        let points = sources.bins.beside(id).map(|p| (p, sources.positions[p as usize]));
        let part = grid.brick_box(id);
        initialise::fix_voxels(sources.geometry, &part, grid.edge() as usize, points, squared, source);
        array.write(slot, |out| {
            out.iter_mut().zip(squared.iter().zip(source.iter())).for_each(|(o, (&d, &s))| *o = value(d, s));
        });
        array.refresh_faces(slot);
        Ok(())
    })?;
    Ok(())
}

/// The eight sweeps of one iteration over all bricks, each in its order of diagonal planes.
fn sweep_all<T: Element>(
    stage: &Stage<'_>,
    array: &mut BrickArray<T>,
    unknown: T,
    sweep: impl Fn(&mut HaloTile<T>, &crate::grid::Box3, [bool; 3]) -> bool + Sync,
) -> Result<()> {
    let set = array.set().clone();
    let grid = *set.grid();
    for id in 0..grid.len() {
        array.set_absent(id, unknown);
    }
    let plan = HaloPlan::new(grid, Reach::Faces);
    let edge = grid.edge() as usize;
    let workers = Workers::new(move || HaloTile::new(edge));
    for upward in SWEEPS {
        for wave in sweep_waves(&set, upward) {
            stage.run(&wave, &workers, |tile, &slot: &Slot| {
                plan.gather(array, slot, Boundary::Constant(unknown), tile);
                if sweep(tile, &grid.brick_box(set.id(slot)), upward) {
                    plan.scatter(tile, array, slot);
                }
                Ok(())
            })?;
        }
    }
    stage.iterated(1, 0.0);
    Ok(())
}
