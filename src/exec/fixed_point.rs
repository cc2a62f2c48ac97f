//! Fields that are relaxed brick by brick until nothing changes: each brick once, and again after one beside it changed.

use super::comm::messages::Comm;
use super::engine::Stage;
use super::exchange::Exchange;
use super::halo::{HaloPlan, Reach};
use super::relax::{Relax, Until, Waves};
use super::schedule::{checkerboard, corner_colours};
use super::workers::Workers;
use crate::error::Result;
use crate::grid::{FACES, Face, NEIGHBOURS_26, Slot};
use crate::store::{BrickArray, Element};

/// A field whose bricks are relaxed to a fixed point, which is the same in any order.
pub trait FixedPoint: Sync {
    /// What bricks read of those beside them.
    type State: Element;
    /// Buffers of one thread.
    type Work: Send;

    /// The field whose faces bricks read.
    fn field(&self) -> &BrickArray<Self::State>;

    /// Relaxes a brick; returns whether it changed.
    ///
    /// # Errors
    /// When the brick cannot be relaxed; the run ends.
    fn relax(&self, work: &mut Self::Work, slot: Slot) -> Result<bool>;

    /// Takes note that a brick changed; marks bricks to be relaxed again besides those beside it.
    fn changed(&mut self, _slot: Slot, _mark: impl FnMut(Slot)) {}

    /// Nothing is left to do on any rank: takes over what others know that no brick beside theirs tells; marks bricks to be relaxed
    /// again for that.
    ///
    /// # Errors
    /// When another rank is gone.
    fn quiet(&mut self, _comm: &dyn Comm, _mark: impl FnMut(Slot)) -> Result<()> {
        Ok(())
    }
}

/// Relaxes a field to its fixed point, from bricks as far as `reach` says. The rounds are the stage's iterations.
///
/// # Errors
/// When a brick cannot be relaxed, the run is interrupted or another rank is gone.
pub fn relax_to_fixed_point<J: FixedPoint>(
    stage: &Stage<'_>,
    reach: Reach,
    workers: &Workers<J::Work>,
    job: &mut J,
) -> Result<()> {
    let set = job.field().set().clone();
    let exchange = &Exchange::new(stage.comm(), &set, &HaloPlan::new(*set.grid(), reach))?;
    let (waves, neighbours) = match reach {
        Reach::Faces => (checkerboard(&set), FACES.map(Face::offset).to_vec()),
        Reach::All => (corner_colours(&set), NEIGHBOURS_26.to_vec()),
    };
    let mut marked = Marked { job, neighbours, dirty: vec![true; set.len()] };
    let waves = Waves { stage, exchange, workers, waves: &waves };
    loop {
        let rounds = waves.relax(&mut marked, Until::QUIET)?;
        if rounds == 0 {
            return Ok(());
        }
        stage.iterated(rounds, 0.0);
        let Marked { job, dirty, .. } = &mut marked;
        job.quiet(stage.comm(), |slot| dirty[slot as usize] = true)?;
    }
}

/// A field and which of its bricks are to be relaxed.
struct Marked<'a, J> {
    job: &'a mut J,
    neighbours: Vec<[i64; 3]>,
    dirty: Vec<bool>,
}

impl<J: FixedPoint> Relax for Marked<'_, J> {
    type State = J::State;
    type Work = J::Work;
    type Visit = bool;
    type Note = [f64; 0];

    fn field(&self) -> &BrickArray<J::State> {
        self.job.field()
    }

    fn priority(&self, slot: Slot) -> f64 {
        if self.dirty[slot as usize] { 0.0 } else { f64::INFINITY }
    }

    fn visit(&self, work: &mut J::Work, slot: Slot, _wave: usize) -> Result<bool> {
        self.job.relax(work, slot)
    }

    fn note(&self, _slot: Slot, changed: &bool) -> Option<[f64; 0]> {
        changed.then_some([])
    }

    fn visited(&mut self, slot: Slot, _changed: bool) {
        self.dirty[slot as usize] = false;
    }

    fn receive(&mut self, slot: Slot, _note: &[f64; 0]) {
        let set = self.job.field().set();
        for beside in self.neighbours.iter().filter_map(|&offset| set.neighbour(slot, offset)) {
            self.dirty[beside as usize] = true;
        }
        self.job.changed(slot, |slot| self.dirty[slot as usize] = true);
    }
}
