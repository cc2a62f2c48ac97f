//! Sources along with the sweeps of FSM, bit for bit those of the triple loop (Kósa & Mikula 2023, Alg. 7).
//!
//! Bricks of sources are kept as they are now; of how they were before the sweep only faces are kept, which bricks
//! beside them read. What a brick cannot know at its turn is resolved when the sweep is over, in rounds (`trace`); then
//! the faces before the next sweep are made the ones now. Distances are swept as they are alone (`sweep`).

use super::sweep::{Companion, Swept, Visit};
use super::trace::Missing;
use crate::error::Result;
use crate::exec::{Boundary, Exchange, HaloPlan, Reach, Saved, Stage, Until, Waves, Workers, corner_colours};
use crate::grid::{BrickId, FACES, Slot, SourceState};
use crate::kernel::distance::methods::fast_sweeping::FastSweeping;
use crate::kernel::distance::methods::sweep_sources::{Fell, Ghosts, SweepSources};
use crate::kernel::distance::state::neighbours::SWEEPS;
use crate::kernel::distance::state::precision::Precision;
use crate::store::checkpoint::SavedField;
use crate::store::{BrickArray, Scratch};

/// The sources of a field that is being swept.
pub(crate) struct TrackedSweeps<'a> {
    states: &'a BrickArray<SourceState>,
    /// Faces as they were before the sweep.
    before: BrickArray<SourceState>,
    exchange: Exchange<'a>,
    /// For all ghosts, and for each direction of a sweep those that lie upwind.
    plan: HaloPlan,
    upwind: [HaloPlan; 8],
    sources: [SweepSources; 8],
    /// The waves in which what is pending is resolved.
    waves: Vec<Vec<Slot>>,
    /// What the sweep under way left of each brick; ghosts too.
    visits: Vec<Visit>,
}

const BEYOND: Boundary<SourceState> = Boundary::Constant(SourceState::FAR);

fn number(upward: [bool; 3]) -> usize {
    (0..3).map(|a| usize::from(!upward[a]) << a).sum()
}

impl<'a> TrackedSweeps<'a> {
    /// Of the sources in `states`, which fixed voxels on this rank's bricks in `start` have.
    pub(crate) fn new(
        stage: &Stage<'a>,
        scratch: &Scratch,
        states: &'a BrickArray<SourceState>,
        start: &[Slot],
    ) -> Result<Self> {
        let set = states.set();
        let plan = HaloPlan::new(*set.grid(), Reach::All);
        let sources = SWEEPS.map(SweepSources::new);
        let upwind = std::array::from_fn(|n| plan.only(|offset| sources[n].is_upwind(offset)));
        let exchange = Exchange::new(stage.comm(), set, &plan)?;
        let before = BrickArray::blank_faces(scratch, set, SourceState::FAR)?;
        let told = exchange.faces(states, start)?;
        let visits = vec![Visit::default(); set.len()];
        let waves = corner_colours(set);
        let tracked = Self { states, before, exchange, plan, upwind, sources, waves, visits };
        start.iter().chain(&told).for_each(|&slot| tracked.keep_faces(slot));
        Ok(tracked)
    }

    /// Makes the faces of a brick before the sweep those now.
    fn keep_faces(&self, slot: Slot) {
        let area = self.states.set().grid().edge().pow(2) as usize;
        self.before.write_faces(slot, |before| {
            for (face, before) in FACES.into_iter().zip(before.chunks_exact_mut(area)) {
                self.states.read_face(slot, face, |now| before.copy_from_slice(now));
            }
        });
    }

    fn valid(&self, slot: Slot) -> [usize; 3] {
        let set = self.states.set();
        set.grid().brick_box(set.id(slot)).shape().map(|n| n as usize)
    }

    /// Gives voxels of a brick that fell their sources; returns whether any is left pending.
    fn take(&self, fell: &[Fell], ghosts: &mut Ghosts, slot: Slot, upward: [bool; 3]) -> bool {
        let (n, valid, edge) = (number(upward), self.valid(slot), self.states.set().grid().edge() as usize);
        ghosts.now.set_valid(valid);
        ghosts.before.set_valid(valid);
        self.upwind[n].gather_halo(self.states, slot, BEYOND, &mut ghosts.now);
        self.plan.gather_halo(&self.before, slot, BEYOND, &mut ghosts.before);
        let blank = self.states.unwritten(slot);
        let left = self.states.write(slot, |brick| {
            if let Some(value) = blank {
                brick.fill(value);
            }
            self.sources[n].take(fell, brick, edge, valid, ghosts)
        });
        self.states.refresh_faces(slot);
        left
    }

    /// Resolves what it can of the pending voxels of a brick, once the sweep is over.
    fn resolve(&self, ghosts: &mut Ghosts, slot: Slot, upward: [bool; 3]) -> (bool, bool) {
        let (valid, edge) = (self.valid(slot), self.states.set().grid().edge() as usize);
        ghosts.now.set_valid(valid);
        ghosts.before.set_valid(valid);
        self.plan.gather_halo(self.states, slot, BEYOND, &mut ghosts.now);
        self.plan.gather_halo(&self.before, slot, BEYOND, &mut ghosts.before);
        let sources = &self.sources[number(upward)];
        let (found, left) = self.states.write(slot, |brick| sources.resolve(brick, edge, valid, ghosts));
        if found {
            self.states.refresh_faces(slot);
        }
        (found, left)
    }
}

impl<P: Precision> Companion<FastSweeping<P, f64>> for TrackedSweeps<'_> {
    type Work = (Vec<Fell>, Ghosts);

    fn work(edge: usize) -> Self::Work {
        (Vec::new(), Ghosts::new(edge))
    }

    fn sweep(
        &self,
        Swept { method, tile, work, along: (fell, ghosts) }: Swept<'_, FastSweeping<P, f64>, Self::Work>,
        slot: Slot,
        upward: [bool; 3],
    ) -> Visit {
        let changed = method.sweep_recording(tile, work, upward, fell);
        Visit { changed, left: changed && self.take(fell, ghosts, slot, upward) }
    }

    fn after_wave(&mut self, changed: &[(Slot, Visit)]) -> Result<()> {
        for &(slot, visit) in changed {
            self.visits[slot as usize] = visit;
        }
        let changed: Vec<Slot> = changed.iter().map(|(slot, _)| *slot).collect();
        for slot in self.exchange.faces(self.states, &changed)? {
            self.visits[slot as usize].changed = true;
        }
        Ok(())
    }

    fn known(&self) -> (Vec<&dyn SavedField>, Vec<(BrickId, Visit)>) {
        let set = self.states.set();
        let visits = set.owned().map(|slot| (set.id(slot), self.visits[slot as usize]));
        (vec![self.states, &self.before], visits.filter(|(_, visit)| visit.changed || visit.left).collect())
    }

    fn resume(&mut self, saved: &Saved, first: usize, visits: Vec<(BrickId, Visit)>) -> Result<()> {
        saved.restore(first, self.states)?;
        saved.restore(first + 1, &self.before)?;
        let set = self.states.set().clone();
        let own: Vec<Slot> = set.owned().collect();
        self.exchange.faces(&self.before, &own)?;
        self.exchange.faces(self.states, &own)?;
        self.visits.fill(Visit::default());
        for (id, visit) in visits {
            // Of a ghost is known whether it changed.
            match set.own_slot(id) {
                Some(slot) => self.visits[slot as usize] = visit,
                None => set.slot(id).into_iter().for_each(|ghost| self.visits[ghost as usize].changed = visit.changed),
            }
        }
        Ok(())
    }

    fn after_sweep(&mut self, stage: &Stage<'_>, upward: [bool; 3]) -> Result<()> {
        let slots = 0..self.states.set().len() as Slot;
        let left: Vec<Slot> = slots.clone().filter(|&slot| self.visits[slot as usize].left).collect();
        let complete = self.visits.iter().map(|visit| !visit.left).collect();
        let edge = self.states.set().grid().edge() as usize;
        let workers = &Workers::new(move || Ghosts::new(edge));
        let resolve = |ghosts: &mut Ghosts, slot| self.resolve(ghosts, slot, upward);
        let mut missing = Missing::new(self.states, complete, resolve);
        missing.begin(&left, false);
        let waves = &self.waves;
        Waves { stage, exchange: &self.exchange, workers, waves }.relax(&mut missing, Until::QUIET)?;
        slots.filter(|&slot| self.visits[slot as usize].changed).for_each(|slot| self.keep_faces(slot));
        self.visits.fill(Visit::default());
        Ok(())
    }
}
