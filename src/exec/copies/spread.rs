//! Fields that one rank each has computed whole, copied to all others: what they are first, then their bricks, some at a time.
//!
//! ```text
//! field u32 | brick u32 | edge^3 values |  field ...
//! ```
//!
//! Little-endian; a field is named by its place among those of its rank, a brick by its slot.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::borrow::ROUND_BYTES;
use crate::error::Result;
use crate::exec::comm::messages::{Message, damaged};
use crate::exec::comm::records::gather_records;
use crate::exec::engine::Stage;
use crate::grid::{BrickGrid, BrickId, BrickSet, Slot};
use crate::store::{BrickArray, Element};

/// What a field is, without its values.
#[derive(Serialize, Deserialize)]
struct Told {
    number: usize,
    shape: [i64; 3],
    edge: i64,
    bricks: Vec<BrickId>,
    /// What bricks hold that are not stored: runs of equal ones, where each begins and its value.
    runs: Vec<BrickId>,
    constants: Vec<u8>,
}

/// The fields of all ranks, in order of their numbers: this rank's own as they are, those of others as copies without faces. All
/// ranks do it at the same time; a number is that of one rank's field.
///
/// # Errors
/// When scratch runs out or another rank is gone.
pub fn spread_fields<T: Element>(
    stage: &Stage<'_>,
    own: Vec<(usize, BrickArray<T>)>,
) -> Result<Vec<(usize, BrickArray<T>)>> {
    let comm = stage.comm();
    if comm.ranks() == 1 {
        return Ok(own);
    }
    let told: Vec<Told> = own.iter().map(|(number, field)| Told::of(*number, field)).collect();
    let mut copies: Vec<Vec<(usize, BrickArray<T>)>> = Vec::new();
    for (rank, told) in gather_records(comm, &told)?.into_iter().enumerate() {
        let told = if rank == comm.rank() { Vec::new() } else { told };
        copies.push(told.into_iter().map(|told| Ok((told.number, told.copy(stage)?))).collect::<Result<_>>()?);
    }
    let mut bricks = (0..).zip(&own).flat_map(|(n, (_, field))| field.set().owned().map(move |slot| (n, field, slot)));
    let mut next = bricks.next();
    // All others get the same.
    let most = ROUND_BYTES / comm.ranks();
    while comm.any(next.is_some())? {
        let mut message = Vec::new();
        while message.len() < most
            && let Some((n, field, slot)) = next
        {
            message.extend_from_slice(&u32::to_le_bytes(n));
            message.extend_from_slice(&slot.to_le_bytes());
            field.read(slot, |values| T::append_bytes(values, &mut message));
            next = bricks.next();
        }
        for (rank, message) in comm.gather(message)?.iter().enumerate().filter(|(rank, _)| *rank != comm.rank()) {
            take(&copies[rank], message)?;
        }
    }
    let mut all: Vec<_> = own.into_iter().chain(copies.into_iter().flatten()).collect();
    all.sort_by_key(|(number, _)| *number);
    Ok(all)
}

impl Told {
    fn of<T: Element>(number: usize, field: &BrickArray<T>) -> Self {
        let (set, mut runs, mut constants) = (field.set(), Vec::new(), Vec::new());
        let mut before = None;
        for id in (0..set.grid().len()).filter(|&id| set.slot(id).is_none()) {
            let value = field.absent(id);
            if before.replace(value) != Some(value) {
                runs.push(id);
                T::append_bytes(&[value], &mut constants);
            }
        }
        let (shape, edge, bricks) = (set.grid().shape(), set.grid().edge(), set.ids().collect());
        Self { number, shape, edge, bricks, runs, constants }
    }

    /// A field of which no brick has come.
    fn copy<T: Element>(self, stage: &Stage<'_>) -> Result<BrickArray<T>> {
        let set = Arc::new(BrickSet::from_ids(BrickGrid::new(self.shape, self.edge), self.bricks));
        let mut copy = BrickArray::new(stage.scratch(), &set)?;
        let mut constants = vec![T::default(); self.runs.len()];
        if self.constants.len() != size_of_val(constants.as_slice()) {
            return Err(damaged());
        }
        T::fill_from_bytes(&mut constants, &self.constants);
        let ends = self.runs.iter().skip(1).copied().chain([set.grid().len()]);
        for ((&begin, end), value) in self.runs.iter().zip(ends).zip(constants) {
            (begin..end).filter(|&id| set.slot(id).is_none()).for_each(|id| copy.set_absent(id, value));
        }
        Ok(copy)
    }
}

fn take<T: Element>(copies: &[(usize, BrickArray<T>)], message: &[u8]) -> Result<()> {
    let mut message = Message(message);
    while !message.is_empty() {
        let field = u32::from_le_bytes(message.word()?) as usize;
        let (_, copy) = copies.get(field).ok_or_else(damaged)?;
        let slot = Slot::from_le_bytes(message.word()?);
        if !copy.set().owned().contains(&slot) {
            return Err(damaged());
        }
        let values = message.take(copy.set().grid().brick_len() * size_of::<T>())?;
        copy.write(slot, |brick| T::fill_from_bytes(brick, values));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exec::{Budget, Cancel, Comm, Engine, Silent, ThreadComm};
    use crate::grid::Box3;
    use crate::store::{BoxSource, Scratch};

    /// A field of some bricks; the others hold one of two constants.
    fn field(number: usize, folder: &std::path::Path) -> BrickArray<f32> {
        let grid = BrickGrid::new([9 + number as i64, 11, 20], 4);
        let set = Arc::new(BrickSet::from_fn(grid, |id| id % 5 != number as u64 % 3));
        let mut field = BrickArray::new(&Scratch::new(folder, 1 << 30), &set).unwrap();
        (0..grid.len()).filter(|&id| set.slot(id).is_none()).for_each(|id| field.set_absent(id, (id / 20) as f32));
        for slot in set.owned() {
            field.write(slot, |brick| {
                (0..).zip(brick).for_each(|(n, v)| *v = (number * 1000 + n + slot as usize) as f32);
            });
        }
        field
    }

    fn values(field: &BrickArray<f32>) -> Vec<f32> {
        let part = Box3::from_shape(field.set().grid().shape());
        let mut values = vec![0.0; part.len()];
        field.read_box(&part, &mut values).unwrap();
        values
    }

    /// Ranks with several fields, one and none.
    #[test]
    fn every_rank_gets_all_fields_as_they_are() {
        let folder = tempfile::tempdir().unwrap();
        let numbers: [&[usize]; 3] = [&[4, 1], &[], &[0, 2, 3]];
        std::thread::scope(|scope| {
            for comm in ThreadComm::connected(3) {
                let folder = folder.path();
                scope.spawn(move || {
                    let own = numbers[comm.rank()].iter().map(|&number| (number, field(number, folder))).collect();
                    let (scratch, budget) = (Scratch::new(folder, 1 << 30), Budget { total: 1 << 30 });
                    let engine = Engine::new(1, scratch, budget, Cancel::default(), Arc::new(Silent)).unwrap();
                    let engine = engine.as_rank(Arc::new(comm));
                    let all = spread_fields(&engine.stage("spread", 0), own).unwrap();
                    assert_eq!(all.iter().map(|(number, _)| *number).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
                    for (number, copy) in &all {
                        let expected = field(*number, folder);
                        assert_eq!(copy.set().grid().shape(), expected.set().grid().shape());
                        assert_eq!(values(copy), values(&expected), "field {number}");
                    }
                });
            }
        });
    }

    #[test]
    fn what_is_no_field_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let copies = [(0, field(0, folder.path()))];
        let brick = vec![0; 4 * 64];
        let message = |field: u32, slot: Slot| [&field.to_le_bytes()[..], &slot.to_le_bytes(), &brick].concat();
        take(&copies, &message(0, 1)).unwrap();
        for wrong in [message(1, 0), message(0, 10_000), message(0, 1)[..30].to_vec()] {
            take(&copies, &wrong).unwrap_err();
        }
    }
}
