//! Whole bricks of other ranks: for who reads a solved field beyond its own part, such as the voxels around a shard that this
//! rank writes.
//!
//! Each rank asks the owners for bricks by their numbers, a bounded share of them at a time; the answer is, for each brick,
//!
//! ```text
//! brick u64 | 1 where it was written, else 0 | edge^3 values, where it was
//! ```

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::exec::comm::messages::{Message, damaged};
use crate::exec::engine::Stage;
use crate::exec::ownership::Ownership;
use crate::grid::{Box3, BrickGrid, BrickId, BrickSet, Slot};
use crate::store::{BoxSource, BrickArray, Element};

/// Bytes of the bricks that a rank asks for at a time, at most, but for one brick of each other rank.
pub const ROUND_BYTES: usize = 8 << 20;

/// Copies of the bricks numbered `wanted` that others own, in order; none where no rank wants any. What was not written there is
/// `blank`. All ranks do it at the same time, each with numbers of its own.
///
/// # Errors
/// When scratch runs out or another rank is gone.
pub fn borrow_bricks<T: Element>(
    stage: &Stage<'_>,
    array: &BrickArray<T>,
    blank: T,
    wanted: &[BrickId],
) -> Result<Option<BrickArray<T>>> {
    let comm = stage.comm();
    if comm.ranks() == 1 || !comm.any(!wanted.is_empty())? {
        return Ok(None);
    }
    let grid = *array.set().grid();
    let ownership = Ownership::agreed(comm, array.set())?;
    let set = Arc::new(BrickSet::from_ids(grid, wanted.to_vec()));
    let borrowed = BrickArray::blank(stage.scratch(), &set, blank)?;
    let others = comm.others();
    // All others may ask one rank.
    let at_a_time = (ROUND_BYTES / others.len().max(1) / (grid.brick_len() * size_of::<T>())).max(1);
    let mut rounds = wanted.chunks(at_a_time);
    while comm.any(rounds.len() > 0)? {
        let now = rounds.next().unwrap_or_default();
        let ask =
            |rank| now.iter().filter(|id| ownership.owner(**id) == rank).flat_map(|id| id.to_le_bytes()).collect();
        let asked = comm.exchange(&others, others.iter().map(|&rank| ask(rank)).collect())?;
        let answers = asked.iter().map(|ids| answer(array, ids)).collect::<Result<_>>()?;
        for bricks in comm.exchange(&others, answers)? {
            take(&borrowed, &bricks)?;
        }
    }
    Ok(Some(borrowed))
}

/// The bricks whose numbers somebody sent.
fn answer<T: Element>(array: &BrickArray<T>, ids: &[u8]) -> Result<Vec<u8>> {
    let set = array.set();
    let mut message = Vec::new();
    for id in ids.as_chunks().0 {
        let slot = own(set, BrickId::from_le_bytes(*id)).ok_or_else(damaged)?;
        message.extend_from_slice(id);
        let written = array.unwritten(slot).is_none();
        message.push(u8::from(written));
        if written {
            array.read(slot, |values| T::append_bytes(values, &mut message));
        }
    }
    Ok(message)
}

fn take<T: Element>(borrowed: &BrickArray<T>, bricks: &[u8]) -> Result<()> {
    let len = borrowed.set().grid().brick_len() * size_of::<T>();
    let mut bricks = Message(bricks);
    while !bricks.is_empty() {
        let slot = own(borrowed.set(), BrickId::from_le_bytes(bricks.word()?)).ok_or_else(damaged)?;
        if bricks.word()? == [1] {
            let values = bricks.take(len)?;
            borrowed.write(slot, |brick| T::fill_from_bytes(brick, values));
        }
    }
    Ok(())
}

fn own(set: &BrickSet, id: BrickId) -> Option<Slot> {
    let known = Some(id).filter(|&id| id < set.grid().len()).and_then(|id| set.slot(id));
    known.filter(|slot| set.owned().contains(slot))
}

/// Reads a box, dense `[z][y][x]`, of a field of which a rank has its own bricks and copies of others.
///
/// # Errors
/// When a brick is neither.
pub fn read_with_borrowed<T: Element>(
    array: &BrickArray<T>,
    borrowed: Option<&BrickArray<T>>,
    part: &Box3,
    out: &mut [T],
) -> Result<()> {
    let grid = *array.set().grid();
    let Some(borrowed) = borrowed.filter(|_| !grid.bricks_in(part).all(|id| own(array.set(), id).is_some())) else {
        return array.read_box(part, out);
    };
    read_by_bricks(&grid, part, out, |id, shared, values| {
        let from = [array, borrowed].into_iter().find(|array| own(array.set(), id).is_some());
        from.ok_or_else(|| Error::failed("a brick of another rank was not asked for"))?.read_box(shared, values)
    })
}

/// Reads a box, dense `[z][y][x]`, of which each brick's part is read in its own way: `read` gets the brick, that part, and room
/// for its values.
///
/// # Errors
/// Of `read`.
pub fn read_by_bricks<T: Element>(
    grid: &BrickGrid,
    part: &Box3,
    out: &mut [T],
    mut read: impl FnMut(BrickId, &Box3, &mut [T]) -> Result<()>,
) -> Result<()> {
    let mut values = Vec::new();
    for id in grid.bricks_in(part) {
        let shared = grid.brick_box(id).intersect(part);
        values.resize(shared.len(), T::default());
        read(id, &shared, &mut values)?;
        let width = shared.shape()[0] as usize;
        for ((y, z), row) in shared.rows().zip(values.chunks_exact(width)) {
            out[part.offset_of([shared.lo[0], y, z])..][..width].copy_from_slice(row);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exec::{Budget, Cancel, Comm, Engine, HaloPlan, Reach, Silent, ThreadComm};
    use crate::store::Scratch;

    /// The value of every voxel of a field.
    fn value([x, y, z]: [i64; 3]) -> f32 {
        (x + 40 * (y + 40 * z)) as f32
    }

    /// Every rank reads any box of the whole field once it has borrowed what it does not own; bricks that nobody wrote stay blank.
    #[test]
    fn every_rank_can_read_everything() {
        let folder = tempfile::tempdir().unwrap();
        let grid = BrickGrid::new([19, 9, 13], 4);
        let unwritten = |id: BrickId| id % 7 == 3;
        let whole = BrickSet::dense(grid);
        for ranks in [1, 2, 3, 8] {
            let ownership = Ownership::balanced(&whole, ranks);
            std::thread::scope(|scope| {
                for comm in ThreadComm::connected(ranks) {
                    let (folder, whole, ownership) = (folder.path(), &whole, &ownership);
                    scope.spawn(move || {
                        let own = ownership.part(whole, comm.rank(), &HaloPlan::new(grid, Reach::Faces));
                        let wanted: Vec<BrickId> =
                            (0..grid.len()).filter(|&id| ownership.owner(id) != comm.rank()).collect();
                        let scratch = Scratch::new(folder, 1 << 30);
                        let budget = Budget { total: 1 << 30 };
                        let engine = Engine::new(1, scratch.clone(), budget, Cancel::default(), Arc::new(Silent));
                        let engine = engine.unwrap().as_rank(Arc::new(comm));
                        let array = BrickArray::blank(&scratch, &Arc::new(own), -1.0_f32).unwrap();
                        for slot in array.set().owned().filter(|&slot| !unwritten(array.set().id(slot))) {
                            let part = grid.brick_box(array.set().id(slot));
                            let voxels =
                                part.rows().flat_map(|(y, z)| (part.lo[0]..part.hi[0]).map(move |x| [x, y, z]));
                            array.write_box(&part, &voxels.map(value).collect::<Vec<_>>());
                        }
                        let stage = engine.stage("borrow", 0);
                        let borrowed = borrow_bricks(&stage, &array, -1.0, &wanted).unwrap();
                        assert_eq!(borrowed.is_none(), ranks == 1);
                        for part in [Box3::from_shape(grid.shape()), Box3::new([3, 2, 1], [18, 9, 12])] {
                            let mut out = vec![0.0; part.len()];
                            read_with_borrowed(&array, borrowed.as_ref(), &part, &mut out).unwrap();
                            for (y, z) in part.rows() {
                                for voxel in (part.lo[0]..part.hi[0]).map(|x| [x, y, z]) {
                                    let blank = grid.brick_of(voxel).is_some_and(unwritten);
                                    let expected = if blank { -1.0 } else { value(voxel) };
                                    assert_eq!(out[part.offset_of(voxel)], expected);
                                }
                            }
                        }
                    });
                }
            });
        }
    }
}
