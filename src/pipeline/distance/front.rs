//! The `front` schedule: bricks are taken in the order in which distance reaches them and relaxed in memory until
//! nothing in them changes (Chacon & Vladimirsky 2012; algorithms: section 3, "The `front` schedule").
//!
//! A round takes all bricks whose smallest entering value lies within a brick's width of the smallest of all, those of
//! even and of odd parity by turns: no two that share a face at the same time. What a round takes depends on values
//! alone, so results do not depend on threads, ranks or budget. Values only fall, so the end is the fixed point of
//! the update: for another brick size it is the same within the rounding of the update.

use crate::error::Result;
use crate::exec::{Boundary, HaloPlan, Reach, Stage, Workers};
use crate::grid::{Box3, FACES, Slot};
use crate::kernel::distance::method::DistanceMethod;
use crate::store::BrickArray;
use crate::tile::HaloTile;

/// How far beyond the smallest entering value a round reaches, in brick edges.
const ROUND_WIDTH: f64 = 0.5;

/// Carries distance from the bricks in `start`, which hold fixed voxels, as far as `farthest`.
pub(super) fn advance_front<M: DistanceMethod>(
    stage: &Stage<'_>,
    method: &M,
    array: &BrickArray<M::State>,
    start: &[Slot],
    spacing: [f64; 3],
    farthest: f64,
) -> Result<()> {
    let set = array.set().clone();
    let grid = *set.grid();
    let plan = HaloPlan::new(grid, Reach::Faces);
    let edge = grid.edge() as usize;
    let workers = Workers::new(move || (HaloTile::new(edge), M::work(edge)));
    let width = ROUND_WIDTH * edge as f64 * spacing.iter().copied().fold(f64::INFINITY, f64::min);
    let parity = |slot: Slot| grid.coords(set.id(slot)).iter().sum::<i64>() & 1;
    let mut entering = vec![f64::INFINITY; set.len()];
    // Sources are all at distance 0; beside them stand bricks that hold none.
    for &slot in start {
        entering[slot as usize] = 0.0;
        let beside = FACES.iter().filter_map(|face| set.neighbour(slot, face.offset()));
        beside.for_each(|n| entering[n as usize] = 0.0);
    }
    let mut rounds = 0;
    loop {
        let least = entering.iter().copied().fold(f64::INFINITY, f64::min);
        if least.is_infinite() || least > farthest {
            break;
        }
        for colour in 0..2 {
            let due = |slot: &Slot| entering[*slot as usize] <= least + width && parity(*slot) == colour;
            let wave: Vec<Slot> = (0..set.len() as Slot).filter(due).collect();
            let left = stage.run(&wave, &workers, |(tile, work), &slot| {
                plan.gather(array, slot, Boundary::Constant(M::UNKNOWN), tile);
                let part = grid.brick_box(set.id(slot));
                if !method.settle(tile, work, &part) {
                    return Ok([None; 6]);
                }
                let leaving = leaving(method, tile, array, slot, &part);
                plan.scatter(tile, array, slot);
                Ok(leaving)
            })?;
            wave.iter().for_each(|&slot| entering[slot as usize] = f64::INFINITY);
            for (&slot, leaving) in wave.iter().zip(&left) {
                for (face, value) in FACES.iter().zip(leaving) {
                    if let (Some(n), Some(value)) = (set.neighbour(slot, face.offset()), value) {
                        entering[n as usize] = entering[n as usize].min(*value);
                    }
                }
            }
        }
        rounds += 1;
    }
    stage.iterated(rounds, 0.0);
    Ok(())
}

/// For each face the smallest value by which a voxel beside it may fall, among those that changed since the brick's
/// faces were last handed on.
fn leaving<M: DistanceMethod>(
    method: &M,
    tile: &HaloTile<M::State>,
    array: &BrickArray<M::State>,
    slot: Slot,
    part: &Box3,
) -> [Option<f64>; 6] {
    let valid = tile.valid().map(|n| n as isize);
    FACES.map(|face| {
        let (inner, outer) = if face.upper { (valid[face.axis] - 1, valid[face.axis]) } else { (0, -1) };
        let [u, v] = [[1, 2], [0, 2], [0, 1]][face.axis];
        let mut least: Option<f64> = None;
        let mut look = |known: Option<&[M::State]>| {
            for j in 0..valid[v] {
                for i in 0..valid[u] {
                    let mut at = [inner; 3];
                    (at[u], at[v]) = (i, j);
                    let here = tile.data()[tile.at(at[0], at[1], at[2])];
                    let before = known.map_or(M::UNKNOWN, |face| face[j as usize * tile.edge() + i as usize]);
                    if here == before {
                        continue;
                    }
                    at[face.axis] = outer;
                    let beside = tile.data()[tile.at(at[0], at[1], at[2])];
                    let voxel = std::array::from_fn(|a| part.lo[a] + at[a] as i64);
                    if let Some(value) = method.entering(here, beside, voxel) {
                        least = Some(least.map_or(value, |kept| kept.min(value)));
                    }
                }
            }
        };
        match array.unwritten(slot) {
            Some(_) => look(None),
            None => array.read_face(slot, face, |known| look(Some(known))),
        }
        least
    })
}
