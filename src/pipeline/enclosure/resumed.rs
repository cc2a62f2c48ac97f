//! How far a search for an enclosure is: what its checkpoints hold, and where a run that goes on takes it up.
//!
//! A search goes from reach to reach. The distance within one is solved by a front, which is put by like any other; then sides are
//! told, and with balls told again. Each of these steps reads fields that it leaves as they are, so it can be given up wherever it is,
//! and a checkpoint be taken of what it began with.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::near::Near;
use super::tagging::Basin;
use super::watershed::Sides;
use crate::error::{Error, Result};
use crate::exec::{Engine, SavePoint, Saved, Stage, tell_faces};
use crate::grid::BrickSet;
use crate::store::BrickArray;
use crate::store::checkpoint::SavedField;

/// What is known of a search, beside its fields: the distance, and which voxels are inside.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Known {
    /// The reach, physical.
    farthest: f64,
    /// Whether the distance within it is solved.
    is_solved: bool,
    told: Option<Told>,
}

/// The sides as they were told.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Told {
    /// So many balls were tried.
    balls: usize,
    basins: Vec<Basin>,
    lost: Vec<u32>,
    /// The side of each brick that is not stored, in grid order.
    far: Vec<u8>,
}

/// How far a search is.
pub(super) struct Progress<'a> {
    save_point: Option<SavePoint<'a>>,
    /// What an earlier run had put by, until it is taken up.
    saved: Option<Saved>,
    known: Known,
}

impl<'a> Progress<'a> {
    /// Of a search that begins, or is gone on with; `suffix` is added to the names of its stages.
    ///
    /// # Errors
    /// When a checkpoint cannot be understood.
    pub(super) fn begin(engine: &'a Engine, suffix: &str) -> Result<Self> {
        let save_point = engine.save_point(&format!("enclosure{suffix}"));
        let saved = save_point.as_ref().and_then(SavePoint::saved);
        let known = saved.as_ref().map(Saved::facts).transpose()?.unwrap_or_default();
        Ok(Self { save_point, saved, known })
    }

    /// The reach at which an earlier run was ended; else the first one.
    pub(super) fn farthest_or(&self, first: f64) -> f64 {
        if self.saved.is_some() { self.known.farthest } else { first }
    }

    /// How many balls were tried at this reach.
    pub(super) fn balls(&self) -> usize {
        self.known.told.as_ref().map_or(0, |told| told.balls)
    }

    /// The search goes on with this reach; what is known of another one is not needed any more.
    ///
    /// # Errors
    /// When it cannot be put by.
    pub(super) fn reach(&mut self, farthest: f64) -> Result<()> {
        if self.saved.is_some() && farthest == self.known.farthest {
            return Ok(());
        }
        self.known = Known { farthest, ..Known::default() };
        let Self { save_point, known, .. } = self;
        save_point.as_mut().map_or(Ok(()), |save_point| save_point.know(known))
    }

    /// The stage that solves the distance within the reach.
    pub(super) fn stage(&self, engine: &'a Engine, name: &str, total: u64) -> Stage<'a> {
        engine.stage_within(self.save_point.as_ref(), &self.front(), name, total)
    }

    fn front(&self) -> String {
        format!("within {}", self.known.farthest)
    }

    /// The distance that an earlier run had solved, without the bricks that are not stored.
    ///
    /// # Errors
    /// When it cannot be read, or scratch runs out.
    pub(super) fn distance(&self, engine: &Engine, set: &Arc<BrickSet>) -> Result<Option<BrickArray<f32>>> {
        let Some(saved) = self.saved.as_ref().filter(|_| self.known.is_solved) else { return Ok(None) };
        let distance = BrickArray::with_faces(engine.scratch(), set)?;
        saved.restore(0, &distance)?;
        tell_faces(engine.comm(), &distance)?;
        Ok(Some(distance))
    }

    /// The distance is solved.
    ///
    /// # Errors
    /// When the run is to end.
    pub(super) fn solved(&mut self, distance: &BrickArray<f32>) -> Result<()> {
        let front = self.front();
        self.save_point.iter().for_each(|save_point| save_point.forget_part(&front));
        self.known.is_solved = true;
        self.put_by(&[distance])
    }

    /// The sides that an earlier run had told, once.
    ///
    /// # Errors
    /// When they cannot be read, or scratch runs out.
    pub(super) fn sides(&mut self, engine: &Engine, near: Near<'_>) -> Result<Option<Sides>> {
        let (Some(saved), Some(told)) = (self.saved.take(), &self.known.told) else { return Ok(None) };
        let mut inside = BrickArray::with_faces(engine.scratch(), near.distance.set())?;
        let far: Vec<_> = near.far_bricks().collect();
        if far.len() != told.far.len() {
            return Err(Error::failed("the checkpoint is of another grid; leave --resume out to begin anew"));
        }
        far.into_iter().zip(&told.far).for_each(|(id, &side)| inside.set_absent(id, side));
        saved.restore(1, &inside)?;
        tell_faces(engine.comm(), &inside)?;
        Ok(Some(Sides { inside, basins: told.basins.clone(), lost: told.lost.clone() }))
    }

    /// The sides are told, with so many balls.
    ///
    /// # Errors
    /// When the run is to end.
    pub(super) fn told(&mut self, near: Near<'_>, sides: &Sides, balls: usize) -> Result<()> {
        if self.save_point.is_none() {
            return Ok(());
        }
        let far = near.far_bricks().map(|id| sides.inside.absent(id)).collect();
        self.known.told = Some(Told { balls, basins: sides.basins.clone(), lost: sides.lost.clone(), far });
        self.put_by(&[near.distance, &sides.inside])
    }

    /// A step that begins with what is known, of which `fields` are, and leaves it as it is.
    ///
    /// # Errors
    /// Of the step, and when the run is to end.
    pub(super) fn step<R>(&mut self, fields: &[&dyn SavedField], work: impl FnOnce() -> Result<R>) -> Result<R> {
        match &mut self.save_point {
            Some(save_point) => save_point.step(|| &self.known, fields, work),
            None => work(),
        }
    }

    fn put_by(&mut self, fields: &[&dyn SavedField]) -> Result<()> {
        let Self { save_point, known, .. } = self;
        save_point.as_mut().map_or(Ok(()), |save_point| save_point.reached(true, || &*known, fields))
    }
}
