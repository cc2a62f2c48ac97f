//! The `sweep` schedule: ordered passes over all bricks, bit for bit the textbook's triple loops for any brick size and
//! number of threads and ranks (docs/algorithms.md, "The sweep schedule").

use crate::error::Result;
use crate::exec::{Boundary, Exchange, HaloPlan, Reach, Stage, Workers, sweep_waves};
use crate::grid::{BrickSet, FACES, Slot};
use crate::kernel::distance::state::method::OrderedSweeps;
use crate::kernel::distance::state::neighbours::SWEEPS;
use crate::store::BrickArray;
use crate::tile::HaloTile;

/// What a visit of a brick left.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Visit {
    /// Whether any voxel fell.
    pub(crate) changed: bool,
    /// Whether the companion has work left in the brick.
    pub(crate) left: bool,
}

/// What goes along with the sweeps of a method.
pub(crate) trait Companion<M: OrderedSweeps>: Sync {
    /// Buffers of one thread.
    type Work: Send + 'static;

    /// Buffers for bricks of `edge`^3 voxels.
    fn work(edge: usize) -> Self::Work;

    /// Sweeps a gathered tile.
    fn sweep(&self, visit: Swept<'_, M, Self::Work>, slot: Slot, upward: [bool; 3]) -> Visit;

    /// Bricks of a wave were visited.
    fn after_wave(&mut self, _wave: &[(Slot, Visit)]) -> Result<()> {
        Ok(())
    }

    /// A sweep is over.
    fn after_sweep(&mut self, _stage: &Stage<'_>, _upward: [bool; 3]) -> Result<()> {
        Ok(())
    }
}

/// A tile, the method that sweeps it, and the buffers that both have.
pub(crate) struct Swept<'t, M: OrderedSweeps, W> {
    pub(crate) method: &'t M,
    pub(crate) tile: &'t mut HaloTile<M::State>,
    pub(crate) work: &'t mut M::Work,
    pub(crate) along: &'t mut W,
}

/// Nothing goes along.
pub(crate) struct Alone<'a>(pub(crate) &'a BrickSet);

impl<M: OrderedSweeps> Companion<M> for Alone<'_> {
    type Work = ();

    fn work(_: usize) {}

    fn sweep(&self, Swept { method, tile, work, .. }: Swept<'_, M, ()>, slot: Slot, upward: [bool; 3]) -> Visit {
        let part = self.0.grid().brick_box(self.0.id(slot));
        Visit { changed: method.sweep(tile, work, &part, upward), left: false }
    }
}

/// Sweeps up to `iterations` times in all eight directions, or until an iteration changes nothing.
///
/// `start` are this rank's bricks that hold fixed voxels. A brick in which a sweep changed nothing is passed over until
/// one beside it changes: no sweep of any direction could change it.
pub(crate) fn sweep_all<M: OrderedSweeps, C: Companion<M>>(
    stage: &Stage<'_>,
    method: &M,
    array: &BrickArray<M::State>,
    companion: &mut C,
    start: &[Slot],
    iterations: u32,
) -> Result<()> {
    let set = array.set().clone();
    let grid = *set.grid();
    let plan = HaloPlan::new(grid, Reach::Faces);
    let edge = grid.edge() as usize;
    let workers = Workers::new(move || (HaloTile::new(edge), M::work(edge), C::work(edge)));
    let mut quiet = vec![true; set.len()];
    let wake = |quiet: &mut [bool], slot: Slot| {
        let beside = FACES.iter().filter_map(|face| set.neighbour(slot, face.offset()));
        beside.for_each(|n| quiet[n as usize] = false);
    };
    let exchange = Exchange::new(stage.comm(), &set, &plan)?;
    let started_elsewhere = exchange.faces(array, start)?;
    for &slot in start.iter().chain(&started_elsewhere) {
        quiet[slot as usize] = false;
        wake(&mut quiet, slot);
    }
    for _ in 0..iterations {
        let mut resting = true;
        for upward in SWEEPS {
            for mut wave in sweep_waves(&set, upward) {
                wave.retain(|&slot| !quiet[slot as usize]);
                let visited = stage.run(&wave, &workers, |(tile, work, along), &slot| {
                    plan.gather(array, slot, Boundary::Constant(M::UNKNOWN), tile);
                    let visit = companion.sweep(Swept { method, tile, work, along }, slot, upward);
                    if visit.changed {
                        plan.scatter(tile, array, slot);
                    }
                    Ok((slot, visit))
                })?;
                for &(slot, visit) in &visited {
                    quiet[slot as usize] = !visit.changed;
                }
                let changed: Vec<Slot> = visited.iter().filter(|(_, v)| v.changed).map(|(slot, _)| *slot).collect();
                let changed_elsewhere = exchange.faces(array, &changed)?;
                resting &= changed.is_empty();
                changed.iter().chain(&changed_elsewhere).for_each(|&slot| wake(&mut quiet, slot));
                companion.after_wave(&visited)?;
            }
            companion.after_sweep(stage, upward)?;
        }
        stage.iterated(1, 0.0);
        if !stage.comm().any(!resting)? {
            break;
        }
    }
    Ok(())
}
