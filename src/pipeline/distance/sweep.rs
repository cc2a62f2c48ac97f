//! The `sweep` schedule: ordered passes over all bricks, bit for bit the textbook's triple loops for any brick size and
//! number of threads and ranks (algorithms: section 3, "Sweeping brick by brick changes nothing").

use crate::error::Result;
use crate::exec::{Boundary, Exchange, HaloPlan, Reach, Stage, Workers, sweep_waves};
use crate::grid::{FACES, Slot};
use crate::kernel::distance::SWEEPS;
use crate::kernel::distance::method::OrderedSweeps;
use crate::store::BrickArray;
use crate::tile::HaloTile;

/// Sweeps up to `iterations` times in all eight directions, or until an iteration changes nothing.
///
/// `start` are this rank's bricks that hold fixed voxels. A brick in which a sweep changed nothing is passed over until one
/// beside it changes: no sweep of any direction could change it.
pub(super) fn sweep_all<M: OrderedSweeps>(
    stage: &Stage<'_>,
    method: &M,
    array: &BrickArray<M::State>,
    start: &[Slot],
    iterations: u32,
) -> Result<()> {
    let set = array.set().clone();
    let grid = *set.grid();
    let plan = HaloPlan::new(grid, Reach::Faces);
    let edge = grid.edge() as usize;
    let workers = Workers::new(move || (HaloTile::new(edge), M::work(edge)));
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
                let changed = stage.run(&wave, &workers, |(tile, work), &slot| {
                    plan.gather(array, slot, Boundary::Constant(M::UNKNOWN), tile);
                    let changed = method.sweep(tile, work, &grid.brick_box(set.id(slot)), upward);
                    if changed {
                        plan.scatter(tile, array, slot);
                    }
                    Ok(changed)
                })?;
                for (&slot, &changed) in wave.iter().zip(&changed) {
                    quiet[slot as usize] = !changed;
                }
                let changed: Vec<Slot> =
                    wave.iter().zip(&changed).filter(|(_, c)| **c).map(|(slot, _)| *slot).collect();
                let changed_elsewhere = exchange.faces(array, &changed)?;
                resting &= changed.is_empty();
                changed.iter().chain(&changed_elsewhere).for_each(|&slot| wake(&mut quiet, slot));
            }
        }
        stage.iterated(1, 0.0);
        if !stage.comm().any(!resting)? {
            break;
        }
    }
    Ok(())
}
