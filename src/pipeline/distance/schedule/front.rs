//! The `front` schedule: bricks are taken in the order in which distance reaches them and relaxed in memory until
//! nothing in them changes (Chacon & Vladimirsky 2012; docs/algorithms.md, "The front schedule").
//!
//! A round takes all bricks whose smallest entering value lies within a brick's width of the smallest of all, those of
//! even and of odd parity by turns: no two that share a face at the same time (where a method looks at 26 neighbours,
//! by eight turns: no two that share a corner). What a round takes depends on values alone, so results do not depend
//! on threads, ranks or budget. Values only fall, so the end is the fixed point of the update: for any brick size that
//! of sweeps to convergence, within 10 units in the last place times the ratio of the largest to the smallest spacing
//! (rounding; over 420 random clouds 3 units were the most for equal spacings, 10 at a ratio of 4, 32 at 6.2).

use crate::error::Result;
use crate::exec::{Boundary, Exchange, HaloPlan, Reach, Stage, Workers};
use crate::grid::{FACES, Slot};
use crate::kernel::distance::state::method::DistanceMethod;
use crate::kernel::distance::state::neighbours::Neighbours;
use crate::kernel::distance::tile_order::arrival::{leaving, leaving_anywhere};
use crate::store::BrickArray;
use crate::tile::HaloTile;

/// How far beyond the smallest entering value a round reaches, in brick edges.
const ROUND_WIDTH: f64 = 0.5;

/// Carries distance from this rank's bricks in `start`, which hold fixed voxels, as far as `farthest`.
pub(crate) fn advance_front<M: DistanceMethod>(
    stage: &Stage<'_>,
    method: &M,
    array: &BrickArray<M::State>,
    start: &[Slot],
    spacing: [f64; 3],
    farthest: f64,
) -> Result<()> {
    let set = array.set().clone();
    let grid = *set.grid();
    let all = method.neighbours() == Neighbours::All;
    let plan = HaloPlan::new(grid, if all { Reach::All } else { Reach::Faces });
    let offsets = method.neighbours().offsets();
    let edge = grid.edge() as usize;
    let workers = Workers::new(move || (HaloTile::new(edge), M::work(edge)));
    let width = ROUND_WIDTH * edge as f64 * spacing.iter().copied().fold(f64::INFINITY, f64::min);
    // Bricks of one colour do not touch.
    let colour_of = |slot: Slot| {
        let at = grid.coords(set.id(slot)).map(|at| at & 1);
        if all { at[0] | at[1] << 1 | at[2] << 2 } else { (at[0] + at[1] + at[2]) & 1 }
    };
    let mut entering = vec![f64::INFINITY; set.len()];
    // Nobody was told of the fixed voxels on these bricks' faces yet.
    let mut untold = vec![false; set.len()];
    for &slot in start {
        entering[slot as usize] = 0.0;
        untold[slot as usize] = true;
    }
    let exchange = Exchange::new(stage.comm(), &set, &plan)?;
    exchange.faces(array, start)?;
    let mut rounds = 0;
    loop {
        let least = stage.comm().least(entering.iter().copied().fold(f64::INFINITY, f64::min))?;
        if least.is_infinite() || least > farthest {
            break;
        }
        for colour in 0..if all { 8 } else { 2 } {
            let due = |slot: &Slot| entering[*slot as usize] <= least + width && colour_of(*slot) == colour;
            let wave: Vec<Slot> = set.owned().filter(due).collect();
            let left = stage.run(&wave, &workers, |(tile, work), &slot| {
                plan.gather(array, slot, Boundary::Constant(M::UNKNOWN), tile);
                let part = grid.brick_box(set.id(slot));
                let changed = method.settle(tile, work, &part);
                if !changed && !untold[slot as usize] {
                    return Ok(Vec::new());
                }
                let leaving: Vec<Option<f64>> = if all {
                    offsets.iter().map(|&offset| leaving_anywhere(method, tile, &part, offset)).collect()
                } else if untold[slot as usize] || array.unwritten(slot).is_some() {
                    FACES.map(|face| leaving(method, tile, &part, face, None)).to_vec()
                } else {
                    let told =
                        |face| array.read_face(slot, face, |told| leaving(method, tile, &part, face, Some(told)));
                    FACES.map(told).to_vec()
                };
                if changed {
                    plan.scatter(tile, array, slot);
                }
                Ok(leaving)
            })?;
            for &slot in &wave {
                entering[slot as usize] = f64::INFINITY;
                untold[slot as usize] = false;
            }
            for (&slot, leaving) in wave.iter().zip(&left) {
                for (&offset, value) in offsets.iter().zip(leaving) {
                    if let (Some(n), Some(value)) = (set.neighbour(slot, offset), value) {
                        entering[n as usize] = entering[n as usize].min(*value);
                    }
                }
            }
            exchange.faces(array, &wave)?;
            exchange.lowest(&mut entering)?;
        }
        rounds += 1;
    }
    stage.iterated(rounds, 0.0);
    Ok(())
}
