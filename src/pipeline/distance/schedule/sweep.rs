//! The `sweep` schedule: ordered passes over all bricks, bit for bit the textbook's triple loops for any brick size and
//! number of threads and ranks (docs/algorithms.md, "The sweep schedule").

use serde::{Deserialize, Serialize};

use super::front::bricks_between_pauses;
use crate::error::Result;
use crate::exec::sweep_waves;
use crate::exec::{Boundary, Exchange, HaloPlan, Place, Reach, Relax, SavePoint, Saved, Stage, Waves, Workers};
use crate::grid::{BrickId, BrickSet, FACES, Slot};
use crate::kernel::distance::state::method::OrderedSweeps;
use crate::kernel::distance::state::neighbours::SWEEPS;
use crate::store::BrickArray;
use crate::store::checkpoint::SavedField;
use crate::tile::HaloTile;

/// What a visit of a brick left.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Visit {
    /// Whether any voxel fell.
    pub(crate) changed: bool,
    /// Whether the companion has work left in the brick.
    pub(crate) left: bool,
}

/// What goes along with the sweeps of a method.
pub(crate) trait Companion<M: OrderedSweeps>: Sync {
    /// Buffers of one thread.
    type Work: Send + 'static;

    /// Buffers for bricks of `edge`^3 voxels.
    fn work(edge: usize) -> Self::Work;

    /// Sweeps a gathered tile.
    fn sweep(&self, visit: Swept<'_, M, Self::Work>, slot: Slot, upward: [bool; 3]) -> Visit;

    /// Bricks of this rank changed in a wave.
    fn after_wave(&mut self, _changed: &[(Slot, Visit)]) -> Result<()> {
        Ok(())
    }

    /// What it knows for a checkpoint within a sweep: the fields of it, which follow that of the method, and what this rank's bricks
    /// were left with.
    fn known(&self) -> (Vec<&dyn SavedField>, Vec<(BrickId, Visit)>) {
        (Vec::new(), Vec::new())
    }

    /// Takes up what another run knew; its fields are those of a checkpoint from the `first` one on. All ranks do.
    ///
    /// # Errors
    /// When they cannot be read, or another rank is gone.
    fn resume(&mut self, _saved: &Saved, _first: usize, _visits: Vec<(BrickId, Visit)>) -> Result<()> {
        Ok(())
    }

    /// A sweep is over.
    fn after_sweep(&mut self, _stage: &Stage<'_>, _upward: [bool; 3]) -> Result<()> {
        Ok(())
    }
}

/// A tile, the method that sweeps it, and the buffers that both have.
pub(crate) struct Swept<'t, M: OrderedSweeps, W> {
    pub(crate) method: &'t M,
    pub(crate) tile: &'t mut HaloTile<M::State>,
    pub(crate) work: &'t mut M::Work,
    pub(crate) along: &'t mut W,
}

/// Nothing goes along.
pub(crate) struct NoCompanion<'a>(pub(crate) &'a BrickSet);

impl<M: OrderedSweeps> Companion<M> for NoCompanion<'_> {
    type Work = ();

    fn work(_: usize) {}

    fn sweep(&self, Swept { method, tile, work, .. }: Swept<'_, M, ()>, slot: Slot, upward: [bool; 3]) -> Visit {
        let part = self.0.grid().brick_box(self.0.id(slot));
        Visit { changed: method.sweep(tile, work, &part, upward), left: false }
    }
}

/// Sweeps up to `iterations` times in all eight directions, or until an iteration changes nothing.
///
/// `start` are this rank's bricks that hold fixed voxels. A brick in which a sweep changed nothing is passed over until
/// one beside it changes: no sweep of any direction could change it. `then` is made of the distance and leaves it as it is.
pub(crate) fn sweep_all<M: OrderedSweeps, C: Companion<M>>(
    stage: &Stage<'_>,
    method: &M,
    array: &BrickArray<M::State>,
    companion: &mut C,
    start: &[Slot],
    iterations: u32,
    then: impl FnOnce() -> Result<()>,
) -> Result<()> {
    let set = array.set();
    let edge = set.grid().edge() as usize;
    let plan = HaloPlan::new(*set.grid(), Reach::Faces);
    let exchange = &Exchange::new(stage.comm(), set, &plan)?;
    let workers = &Workers::new(move || (HaloTile::new(edge), M::work(edge), C::work(edge)));
    let begun_elsewhere = exchange.faces(array, start)?;
    let known = Known { quiet: vec![true; set.len()], ..Known::default() };
    let save_point = stage.save_point();
    let mut sweeps = Sweeps { method, array, companion, plan, known, changed: Vec::new(), save_point };
    for &slot in start.iter().chain(&begun_elsewhere) {
        sweeps.known.quiet[slot as usize] = false;
        sweeps.receive(slot, &[]);
    }
    sweeps.resume(exchange)?;
    stage.iterated(sweeps.known.iterations.into(), 0.0);
    while !sweeps.known.ended && sweeps.known.iterations < iterations {
        while sweeps.known.sweep < SWEEPS.len() {
            let upward = sweeps.upward();
            let from = std::mem::take(&mut sweeps.known.within).unwrap_or(Place::before(0.0));
            let waves = &sweep_waves(set, upward);
            Waves { stage, exchange, workers, waves }.round(&mut sweeps, from)?;
            sweeps.companion.after_sweep(stage, upward)?;
            sweeps.known.sweep += 1;
            sweeps.put_by(None)?;
        }
        stage.iterated(1, 0.0);
        let known = &mut sweeps.known;
        known.ended = !stage.comm().any(known.changed)?;
        (known.iterations, known.sweep, known.changed) = (known.iterations + 1, 0, false);
    }
    sweeps.known.ended = true;
    sweeps.put_by(None)?;
    match sweeps.save_point.take() {
        Some(mut save_point) => sweeps.with_all(None, |known, fields| save_point.step(known, fields, then)),
        None => then(),
    }
}

/// How far sweeps are.
#[derive(Clone, Default)]
struct Known {
    /// Iterations that are done, and sweeps of the one that is under way.
    iterations: u32,
    sweep: usize,
    /// Whether this one has changed anything.
    changed: bool,
    /// The sweep that is under way; between two there is none.
    within: Option<Place>,
    /// Bricks that no sweep of any direction could change.
    quiet: Vec<bool>,
    /// Bricks of the wave under way that were visited; before one begins there are none.
    visited: Vec<Slot>,
    ended: bool,
}

impl Known {
    /// What a checkpoint holds of it: the same of the bricks that this rank owns, by their numbers.
    fn saved(&self, within: Option<Place>, set: &BrickSet, visits: Vec<(BrickId, Visit)>) -> SavedSweeps {
        let ids = |slots: &mut dyn Iterator<Item = Slot>| slots.map(|slot| set.id(slot)).collect();
        SavedSweeps {
            iterations: self.iterations,
            sweep: self.sweep,
            changed: self.changed,
            within,
            due: ids(&mut set.owned().filter(|&slot| !self.quiet[slot as usize])),
            visited: ids(&mut self.visited.iter().copied()),
            visits,
            ended: self.ended,
        }
    }

    /// What ranks had put by, on those that this one owns.
    fn of(saved: &[SavedSweeps], set: &BrickSet) -> Self {
        let mut known = Self { quiet: vec![true; set.len()], ..Self::default() };
        for part in saved {
            let own = |ids: &[BrickId]| ids.iter().filter_map(|&id| set.own_slot(id)).collect::<Vec<_>>();
            (known.iterations, known.sweep, known.within, known.ended) =
                (part.iterations, part.sweep, part.within, part.ended);
            known.changed |= part.changed;
            known.visited.extend(own(&part.visited));
            for slot in own(&part.due) {
                known.quiet[slot as usize] = false;
            }
        }
        known
    }
}

/// What a checkpoint holds of the sweeps of a rank, beside their fields.
#[derive(Serialize, Deserialize)]
struct SavedSweeps {
    iterations: u32,
    sweep: usize,
    changed: bool,
    within: Option<Place>,
    /// Bricks that are not quiet.
    due: Vec<BrickId>,
    visited: Vec<BrickId>,
    /// What its bricks left with the companion.
    visits: Vec<(BrickId, Visit)>,
    ended: bool,
}

struct Sweeps<'a, M: OrderedSweeps, C> {
    method: &'a M,
    array: &'a BrickArray<M::State>,
    companion: &'a mut C,
    plan: HaloPlan,
    known: Known,
    /// Those of this rank that changed in the wave.
    changed: Vec<(Slot, Visit)>,
    save_point: Option<SavePoint<'a>>,
}

impl<M: OrderedSweeps, C: Companion<M>> Sweeps<'_, M, C> {
    fn upward(&self) -> [bool; 3] {
        SWEEPS[self.known.sweep]
    }

    /// Goes on where an earlier run was ended, on as many ranks as that had.
    fn resume(&mut self, exchange: &Exchange<'_>) -> Result<()> {
        let Some(saved) = self.save_point.as_ref().and_then(SavePoint::saved) else { return Ok(()) };
        let parts: Vec<SavedSweeps> = saved.facts_of_all()?;
        let set = self.array.set();
        saved.restore(0, self.array)?;
        exchange.faces(self.array, &set.owned().collect::<Vec<_>>())?;
        self.known = Known::of(&parts, set);
        self.companion.resume(&saved, 1, parts.into_iter().flat_map(|part| part.visits).collect())
    }

    /// Tells what changed since it was told last.
    fn tell_companion(&mut self) -> Result<()> {
        let changed = std::mem::take(&mut self.changed);
        self.companion.after_wave(&changed)
    }

    /// Between two sweeps, or within one.
    fn put_by(&mut self, within: Option<Place>) -> Result<()> {
        let Some(mut save_point) = self.save_point.take() else { return Ok(()) };
        let ended = self.known.ended;
        self.with_all(within, |known, fields| save_point.reached(ended, known, fields))?;
        self.save_point = Some(save_point);
        Ok(())
    }

    /// Hands on what a checkpoint holds.
    fn with_all<R>(
        &self,
        within: Option<Place>,
        take: impl FnOnce(&dyn Fn() -> SavedSweeps, &[&dyn SavedField]) -> R,
    ) -> R {
        let (of_companion, visits) = self.companion.known();
        let fields: Vec<&dyn SavedField> = std::iter::once(self.array as &dyn SavedField).chain(of_companion).collect();
        take(&|| self.known.saved(within, self.array.set(), visits.clone()), &fields)
    }
}

impl<M: OrderedSweeps, C: Companion<M>> Relax for Sweeps<'_, M, C> {
    type State = M::State;
    type Work = (HaloTile<M::State>, M::Work, C::Work);
    type Visit = Visit;
    type Note = [f64; 0];

    fn field(&self) -> &BrickArray<M::State> {
        self.array
    }

    fn priority(&self, slot: Slot) -> f64 {
        let is_due = !self.known.quiet[slot as usize] && !self.known.visited.contains(&slot);
        if is_due { 0.0 } else { f64::INFINITY }
    }

    fn visit(&self, (tile, work, along): &mut Self::Work, slot: Slot, _wave: usize) -> Result<Visit> {
        self.plan.gather(self.array, slot, Boundary::Constant(M::UNKNOWN), tile);
        let visit = self.companion.sweep(Swept { method: self.method, tile, work, along }, slot, self.upward());
        if visit.changed {
            self.plan.scatter(tile, self.array, slot);
        }
        Ok(visit)
    }

    fn note(&self, _slot: Slot, visit: &Visit) -> Option<[f64; 0]> {
        visit.changed.then_some([])
    }

    fn visited(&mut self, slot: Slot, visit: Visit) {
        self.known.quiet[slot as usize] = !visit.changed;
        self.known.changed |= visit.changed;
        if self.save_point.is_some() {
            self.known.visited.push(slot);
        }
        if visit.changed {
            self.changed.push((slot, visit));
        }
    }

    fn receive(&mut self, slot: Slot, _note: &[f64; 0]) {
        let set = self.array.set();
        let beside = FACES.iter().filter_map(|face| set.neighbour(slot, face.offset()));
        beside.for_each(|n| self.known.quiet[n as usize] = false);
    }

    fn pauses_after(&self) -> Option<usize> {
        let save_point = self.save_point.as_ref().filter(|save_point| save_point.is_alone());
        save_point.map(|_| bricks_between_pauses(self.array.set()))
    }

    fn paused(&mut self, at: Place) -> Result<()> {
        self.tell_companion()?;
        self.put_by(Some(at))
    }

    fn after_wave(&mut self) -> Result<()> {
        self.known.visited.clear();
        self.tell_companion()
    }
}
