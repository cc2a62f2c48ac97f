//! Sources for methods that keep distances only: found after the distances, in a field of their own (`kernel::distance::trace`).
//!
//! Bricks that hold fixed voxels come first, then those beside bricks in which sources were found, as long as any is
//! missing there. Bricks with a face, edge or corner in common never run at the same time, so what a round does not
//! depend on threads; what is found does not even depend on the rounds.

use crate::error::Result;
use crate::exec::{Boundary, Exchange, HaloPlan, Reach, Stage, Workers};
use crate::grid::{Box3, Geometry, NEIGHBOURS_26, Slot};
use crate::kernel::distance::initialise::NO_SOURCE;
use crate::kernel::distance::precision::Precision;
use crate::kernel::distance::trace::Tracer;
use crate::kernel::distance::vector_distance::FIXED;
use crate::store::{BoxSource, BrickArray};
use crate::tile::HaloTile;

/// Carries sources from the fixed voxels on the bricks in `start` along finished distances.
pub(super) fn trace_sources<P: Precision>(
    stage: &Stage<'_>,
    geometry: &Geometry,
    distances: &BrickArray<P>,
    states: &BrickArray<u32>,
    start: &[Slot],
) -> Result<()> {
    let set = distances.set().clone();
    let grid = *set.grid();
    let plan = HaloPlan::new(grid, Reach::All);
    let edge = grid.edge() as usize;
    let tracer = Tracer::new(geometry, edge);
    let workers = Workers::new(move || (HaloTile::new(edge), HaloTile::new(edge), tracer.clone()));
    let colour = |slot: Slot| grid.coords(set.id(slot)).iter().fold(0, |colour, at| colour << 1 | (at & 1));
    // 0 for bricks that are due, else infinite: what ranks tell each other.
    let mut due = vec![f64::INFINITY; set.len()];
    // Nobody was told of their fixed voxels yet.
    let mut untold = vec![false; set.len()];
    let mut complete: Vec<bool> = (0..set.len() as Slot).map(|slot| distances.unwritten(slot).is_some()).collect();
    for &slot in start {
        (due[slot as usize], untold[slot as usize]) = (0.0, true);
    }
    let exchange = Exchange::new(stage.comm(), &set, &plan)?;
    exchange.faces(distances, &set.owned().collect::<Vec<_>>())?;
    exchange.faces(states, start)?;
    while stage.comm().any(due.contains(&0.0))? {
        for turn in 0..8 {
            let is_due = |slot: &Slot| due[*slot as usize] == 0.0 && colour(*slot) == turn;
            let wave: Vec<Slot> = set.owned().filter(is_due).collect();
            let traced = stage.run(&wave, &workers, |(distance, state, tracer), &slot| {
                plan.gather(distances, slot, Boundary::Constant(P::UNKNOWN), distance);
                plan.gather(states, slot, Boundary::Constant(NO_SOURCE), state);
                let (found, left) = tracer.trace(distance, state);
                if found {
                    plan.scatter(state, states, slot);
                }
                Ok((found, left))
            })?;
            for (&slot, (found, left)) in wave.iter().zip(traced) {
                due[slot as usize] = f64::INFINITY;
                complete[slot as usize] = !left;
                if found || std::mem::take(&mut untold[slot as usize]) {
                    let beside = NEIGHBOURS_26.iter().filter_map(|&offset| set.neighbour(slot, offset));
                    beside.for_each(|n| due[n as usize] = 0.0);
                }
            }
            exchange.faces(states, &wave)?;
            exchange.lowest(&mut due)?;
            for slot in set.owned().filter(|&slot| complete[slot as usize]) {
                due[slot as usize] = f64::INFINITY;
            }
        }
    }
    Ok(())
}

/// A field of states, read as the indices of sources.
pub(super) struct SourceField(pub(super) BrickArray<u32>);

impl BoxSource<u32> for SourceField {
    fn shape(&self) -> [i64; 3] {
        self.0.set().grid().shape()
    }

    fn read_box(&self, part: &Box3, out: &mut [u32]) -> Result<()> {
        self.0.read_box(part, out)?;
        for state in out {
            *state &= !FIXED;
        }
        Ok(())
    }
}
