//! A last look at sources outside of the grid, where a method keeps sources: of those that lie denser than voxels one may
//! be nearest to a voxel deep in the grid and to none of its outermost layer, so that none hands it on
//! (docs/algorithms.md, "Outside of the grid").

use crate::error::Result;
use crate::exec::{Stage, Workers};
use crate::grid::{NO_SOURCE, Slot};
use crate::kernel::distance::seeding::seeds::Seeds;
use crate::kernel::distance::state::method::DistanceState;
use crate::pipeline::distance::Sources;
use crate::store::BrickArray;

/// Gives voxels of this rank's bricks the source outside that is nearer than the one they were handed, where there is one,
/// none that is farther than `farthest` and some voxels more. Faces of bricks stay as they are: nobody is told.
pub(crate) fn search_outside<M: DistanceState>(
    stage: &Stage<'_>,
    sources: &Sources<'_>,
    method: &M,
    array: &BrickArray<M::State>,
    farthest: f64,
) -> Result<()> {
    let Some(outside) = sources.outside.filter(|_| M::trial(0).is_some()) else { return Ok(()) };
    let set = array.set();
    let (grid, len, edge) = (*set.grid(), set.grid().brick_len(), set.grid().edge() as usize);
    let farthest = farthest + sources.geometry.length([2; 3]);
    // What nothing was carried to lies farther.
    let reached: Vec<Slot> = set.owned().filter(|&slot| array.unwritten(slot).is_none()).collect();
    let workers = Workers::new(move || Seeds::new(len));
    stage.run(&reached, &workers, |held, &slot| {
        let part = grid.brick_box(set.id(slot));
        let each = || {
            part.rows().flat_map(|(y, z)| {
                let at = ((z - part.lo[2]) as usize * edge + (y - part.lo[1]) as usize) * edge;
                (part.lo[0]..part.hi[0]).zip(at..).map(move |(x, at)| ([x, y, z], at))
            })
        };
        array.read(slot, |states| {
            for (voxel, at) in each() {
                held.squared[at] = method.distance_squared(states[at], voxel);
                held.source[at] = M::source(states[at]).unwrap_or(NO_SOURCE);
            }
        });
        if outside.lower(&part, edge, farthest, held) {
            array.write(slot, |states| {
                for (_, at) in each() {
                    let (state, source) = (states[at], held.source[at]);
                    if M::source(state) == Some(source) || source == NO_SOURCE {
                        continue;
                    }
                    let told = if M::is_fixed(state) { None } else { M::trial(source) };
                    states[at] = told.unwrap_or_else(|| M::fixed(held.squared[at], source));
                }
            });
        }
        Ok(())
    })?;
    Ok(())
}
