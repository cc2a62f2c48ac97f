//! The one driver of everything that goes in waves: which bricks are due, in which order they are visited, what they tell
//! each other and other ranks, and when it is over.
//!
//! A round takes the waves of a colouring one after the other; bricks of one wave do not read each other. Of a wave those
//! are visited that are due. What a visit changed is told to the bricks beside it: on this rank by [`Relax::receive`], on
//! others by the faces of the brick and a note, which travel while the bricks that nobody else reads are visited. What is
//! visited follows from values alone, so results depend neither on threads nor on ranks. A job that can be put by visits its
//! waves some bricks at a time: as those of a wave do not read each other, that is the same for its values.

use serde::{Deserialize, Serialize};

use super::engine::Stage;
use super::exchange::{Exchange, Note};
use super::workers::Workers;
use crate::error::Result;
use crate::grid::Slot;
use crate::store::{BrickArray, Element};

/// A job that goes in waves: a field, what is due in it, and how one brick is relaxed.
pub trait Relax: Sync {
    /// What bricks read of those beside them.
    type State: Element;
    /// Buffers of one thread.
    type Work: Send;
    /// What a visit leaves.
    type Visit: Send;
    /// What a changed brick tells those beside it.
    type Note: Note;

    /// The field whose faces bricks read.
    fn field(&self) -> &BrickArray<Self::State>;

    /// How near a brick's turn is: a round visits those up to a limit. Infinite where there is nothing to do.
    fn priority(&self, slot: Slot) -> f64;

    /// Relaxes a brick, in the wave of that number of its round.
    ///
    /// # Errors
    /// When the brick cannot be relaxed; the run ends.
    fn visit(&self, work: &mut Self::Work, slot: Slot, wave: usize) -> Result<Self::Visit>;

    /// What the bricks beside a visited one are told; nothing where they would find nothing new.
    fn note(&self, slot: Slot, visit: &Self::Visit) -> Option<Self::Note>;

    /// Takes what a visit left, before anybody is told of the wave.
    fn visited(&mut self, slot: Slot, visit: Self::Visit);

    /// Takes what a brick tells, of this rank or a ghost: wakes those beside it.
    fn receive(&mut self, slot: Slot, note: &Self::Note);

    /// A round begins; `nearest` is the priority of the brick that is due next, of all ranks.
    ///
    /// # Errors
    /// When who looks on fails; the run ends.
    fn before_round(&mut self, _nearest: f64) -> Result<()> {
        Ok(())
    }

    /// Where a job can be put by within a wave: so many bricks of it each thread visits between two such places, at least. What
    /// these leave and tell is taken at once, which must concern no brick of the same wave.
    fn pauses_after(&self) -> Option<usize> {
        None
    }

    /// Such a place: some bricks of a wave are visited and told, those that are yet to come are still due.
    ///
    /// # Errors
    /// When the run is to end.
    fn paused(&mut self, _at: Place) -> Result<()> {
        Ok(())
    }

    /// All of a wave, on this rank and beside it, was visited and told.
    ///
    /// # Errors
    /// When another rank is gone, or the run is to end.
    fn after_wave(&mut self) -> Result<()> {
        Ok(())
    }
}

/// A place within a round.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// The wave that is under way, by its number in the round.
    pub wave: usize,
    /// The priority up to which the round takes bricks.
    pub limit: f64,
}

impl Place {
    /// Before the first wave of a round that takes bricks up to a priority.
    #[must_use]
    pub fn before(limit: f64) -> Self {
        Self { wave: 0, limit }
    }
}

/// The waves of a colouring over the bricks of one rank.
pub struct Waves<'w, 'a, W> {
    /// Visits bricks, and counts them.
    pub stage: &'w Stage<'a>,
    /// Who else reads this rank's bricks.
    pub exchange: &'w Exchange<'a>,
    /// Buffers for each thread.
    pub workers: &'w Workers<W>,
    /// The bricks of each wave; all ranks have as many waves.
    pub waves: &'w [Vec<Slot>],
}

/// Which bricks a round takes, and when rounds end.
#[derive(Clone, Copy, Debug)]
pub struct Until {
    /// A round takes what is at most so much behind the nearest of all ranks.
    pub width: f64,
    /// What is farther than this is left.
    pub farthest: f64,
}

impl Until {
    /// Until nothing is due, all that is due at once.
    pub const QUIET: Self = Self { width: 0.0, farthest: f64::MAX };
}

impl<W: Send> Waves<'_, '_, W> {
    /// Rounds until nothing is due on any rank. Returns how many.
    ///
    /// # Errors
    /// When a visit fails, the run is interrupted or another rank is gone.
    pub fn relax<R: Relax<Work = W>>(&self, job: &mut R, until: Until) -> Result<u64> {
        let mut rounds = 0;
        while let Some(nearest) = self.nearest(job)?.filter(|nearest| *nearest <= until.farthest) {
            job.before_round(nearest)?;
            self.round(job, Place::before(nearest + until.width))?;
            rounds += 1;
        }
        Ok(rounds)
    }

    /// The priority of the brick that is due next, of all ranks; none where nothing is.
    ///
    /// # Errors
    /// When another rank is gone.
    pub fn nearest<R: Relax<Work = W>>(&self, job: &R) -> Result<Option<f64>> {
        let own = job.field().set().owned().fold(f64::INFINITY, |least, slot| least.min(job.priority(slot)));
        Ok(Some(self.stage.comm().least(own)?).filter(|least| least.is_finite()))
    }

    /// Visits each brick that is due, up to a finite limit, once at its wave, from a place in the round on. Returns whether any
    /// of this rank's changed.
    ///
    /// # Errors
    /// When a visit fails, the run is interrupted or another rank is gone.
    pub fn round<R: Relax<Work = W>>(&self, job: &mut R, from: Place) -> Result<bool> {
        let mut changed = false;
        for (number, wave) in self.waves.iter().enumerate().skip(from.wave) {
            let due = wave.iter().copied().filter(|&slot| job.priority(slot) <= from.limit);
            let (read, others): (Vec<Slot>, Vec<Slot>) = due.partition(|&slot| self.exchange.is_read(slot));
            let mut notes = self.visit(job, &read, number)?;
            self.exchange.post(job.field(), &notes)?;
            if let Some(bricks) = job.pauses_after() {
                changed |= self.visit_in_pieces(job, &others, bricks, Place { wave: number, ..from })?;
            } else {
                notes.extend(self.visit(job, &others, number)?);
            }
            changed |= !notes.is_empty();
            notes.extend(self.exchange.collect(job.field())?);
            for (slot, note) in &notes {
                job.receive(*slot, note);
            }
            job.after_wave()?;
        }
        Ok(changed)
    }

    /// Visits bricks of a wave that no other rank reads, some at a time. Returns whether any changed.
    fn visit_in_pieces<R: Relax<Work = W>>(
        &self,
        job: &mut R,
        wave: &[Slot],
        bricks: usize,
        at: Place,
    ) -> Result<bool> {
        let mut changed = false;
        for piece in wave.chunks((bricks * self.stage.threads()).max(1)) {
            let notes = self.visit(job, piece, at.wave)?;
            changed |= !notes.is_empty();
            for (slot, note) in &notes {
                job.receive(*slot, note);
            }
            job.paused(at)?;
        }
        Ok(changed)
    }

    /// Visits bricks of one wave; returns what those that changed tell.
    fn visit<R: Relax<Work = W>>(&self, job: &mut R, wave: &[Slot], number: usize) -> Result<Vec<(Slot, R::Note)>> {
        let visits = self.stage.run(wave, self.workers, |work, &slot| job.visit(work, slot, number))?;
        let mut notes = Vec::new();
        for (&slot, visit) in wave.iter().zip(visits) {
            notes.extend(job.note(slot, &visit).map(|note| (slot, note)));
            job.visited(slot, visit);
        }
        Ok(notes)
    }
}
