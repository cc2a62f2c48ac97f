//! Fields of which each rank has solved its part, made whole on all of them; and a rank's part of a field that all have.

use std::sync::Arc;

use super::borrow::borrow_bricks;
use crate::error::Result;
use crate::exec::engine::Stage;
use crate::grid::{BrickId, BrickSet};
use crate::store::{BrickArray, Element, Scratch};

/// The field of all ranks over all its bricks `set`, of which `part` is this rank's: with faces where that has some. All ranks do it at the
/// same time; one rank alone keeps what it has.
///
/// # Errors
/// When scratch runs out or another rank is gone.
pub fn whole_field<T: Element>(stage: &Stage<'_>, part: BrickArray<T>, set: &Arc<BrickSet>) -> Result<BrickArray<T>> {
    if stage.comm().ranks() == 1 {
        return Ok(part);
    }
    let whole = empty(stage.scratch(), &part, set)?;
    take_parts(stage, &part, &whole)?;
    Ok(whole)
}

/// Copies the parts of all ranks to a field that is whole. All ranks do it at the same time.
///
/// # Errors
/// When scratch runs out or another rank is gone.
pub fn take_parts<T: Element>(stage: &Stage<'_>, part: &BrickArray<T>, whole: &BrickArray<T>) -> Result<()> {
    take_over(part, whole);
    let of_others: Vec<BrickId> = whole.set().ids().filter(|&id| part.set().own_slot(id).is_none()).collect();
    if let Some(borrowed) = borrow_bricks(stage, part, T::default(), &of_others)? {
        take_over(&borrowed, whole);
    }
    Ok(())
}

/// A rank's own part of a field that it has all of; with the faces of its bricks where that has some, those of ghosts are for the ranks to
/// exchange.
///
/// # Errors
/// When scratch runs out.
pub fn part_of<T: Element>(scratch: &Scratch, whole: &BrickArray<T>, own: &Arc<BrickSet>) -> Result<BrickArray<T>> {
    let part = empty(scratch, whole, own)?;
    take_over(whole, &part);
    Ok(part)
}

/// Another set's field, which is like one where nothing is stored.
fn empty<T: Element>(scratch: &Scratch, like: &BrickArray<T>, set: &Arc<BrickSet>) -> Result<BrickArray<T>> {
    let new = if like.has_faces() { BrickArray::with_faces } else { BrickArray::new };
    let mut field = new(scratch, set)?;
    field.take_absent(like);
    Ok(field)
}

/// Copies the bricks that both have.
fn take_over<T: Element>(from: &BrickArray<T>, to: &BrickArray<T>) {
    for slot in to.set().owned() {
        let Some(other) = from.set().own_slot(to.set().id(slot)) else { continue };
        match from.unwritten(other) {
            Some(value) => to.write(slot, |brick| brick.fill(value)),
            None => from.read(other, |values| to.write(slot, |brick| brick.copy_from_slice(values))),
        }
        if to.has_faces() {
            to.refresh_faces(slot);
        }
    }
}
