//! The `front` schedule: bricks are taken in the order in which distance reaches them and relaxed in memory until
//! nothing in them changes (Chacon & Vladimirsky 2012; docs/algorithms.md, "The front schedule").
//!
//! A round takes all bricks whose smallest entering value lies within a brick's width of the smallest of all, those of
//! even and of odd parity by turns: no two that share a face at the same time (where a method looks at 26 neighbours,
//! by eight turns: no two that share a corner). What a round takes depends on values alone, so results do not depend
//! on threads, ranks or budget. Values only fall, so the end is the fixed point of the update: for any brick size that
//! of sweeps to convergence, within 10 units in the last place times the ratio of the largest to the smallest spacing
//! (rounding; over 420 random clouds 3 units were the most for equal spacings, 10 at a ratio of 4, 32 at 6.2).

use serde::{Deserialize, Serialize};

use super::passing::{Passing, Watch};
use crate::error::Result;
use crate::exec::{Boundary, Exchange, HaloPlan, Place, Reach, Relax, SavePoint, Stage, Until, Waves, Workers};
use crate::exec::{checkerboard, corner_colours};
use crate::grid::{Box3, BrickId, BrickSet, FACES, NEIGHBOURS_26, Slot};
use crate::kernel::distance::state::method::DistanceMethod;
use crate::kernel::distance::state::neighbours::Neighbours;
use crate::kernel::distance::tile_order::arrival::{outgoing, outgoing_anywhere};
use crate::store::BrickArray;
use crate::tile::HaloTile;

/// How far beyond the smallest entering value a round reaches, in brick edges.
const ROUND_WIDTH: f64 = 0.5;

/// Voxels that a thread takes on between two places within a wave where a run can be put by: a second's work, or less; so many that
/// threads wait little for the last of them. Fields of tests are small.
const VOXELS_BETWEEN_PAUSES: usize = if cfg!(test) { 1 << 12 } else { 1 << 23 };

/// The same in bricks.
pub(super) fn bricks_between_pauses(set: &BrickSet) -> usize {
    (VOXELS_BETWEEN_PAUSES / set.grid().brick_len()).max(1)
}

/// Carries distance from this rank's bricks in `start`, which hold fixed voxels, as far as `farthest`; `watch` hears what the
/// front has passed. `then` is made of the distance and leaves it as it is.
pub(crate) fn advance_front<M: DistanceMethod>(
    stage: &Stage<'_>,
    method: &M,
    array: &BrickArray<M::State>,
    start: &[Slot],
    (spacing, farthest): ([f64; 3], f64),
    watch: Option<&dyn Watch>,
    then: impl FnOnce() -> Result<()>,
) -> Result<()> {
    let set = array.set();
    let edge = set.grid().edge() as usize;
    let (reach, waves) = match method.neighbours() {
        Neighbours::Faces => (Reach::Faces, checkerboard(set)),
        Neighbours::All => (Reach::All, corner_colours(set)),
    };
    let plan = HaloPlan::new(*set.grid(), reach);
    let exchange = &Exchange::new(stage.comm(), set, &plan)?;
    exchange.faces(array, start)?;
    let mut front = Front {
        method,
        array,
        plan,
        offsets: method.neighbours().offsets(),
        arrival: vec![f64::INFINITY; set.len()],
        unsent: vec![false; set.len()],
        passing: watch.map(|watch| Passing::new(watch, set, spacing)),
        rounds: 0,
        save_point: stage.save_point(),
    };
    for &slot in start {
        (front.arrival[slot as usize], front.unsent[slot as usize]) = (0.0, true);
    }
    let within = front.resume(exchange)?;
    let workers = &Workers::new(move || (HaloTile::new(edge), M::work(edge)));
    let width = ROUND_WIDTH * edge as f64 * spacing.iter().copied().fold(f64::INFINITY, f64::min);
    let waves = Waves { stage, exchange, workers, waves: &waves };
    if let Some(within) = within {
        waves.round(&mut front, within)?;
    }
    waves.relax(&mut front, Until { width, farthest })?;
    stage.iterated(front.rounds, 0.0);
    front.put_by(true, None)?;
    match front.save_point.take() {
        Some(mut save_point) => {
            save_point.step(|| front.known(None), &[array], then)?;
            save_point.leave(&front.known(None))
        }
        None => then(),
    }
}

struct Front<'a, M: DistanceMethod> {
    method: &'a M,
    array: &'a BrickArray<M::State>,
    plan: HaloPlan,
    /// The steps to the bricks that read a brick.
    offsets: Vec<[i64; 3]>,
    /// The smallest value that enters each brick since it was visited.
    arrival: Vec<f64>,
    /// Nobody was told of the fixed voxels on these bricks' faces yet.
    unsent: Vec<bool>,
    /// What nothing can change any more, where somebody wants to know.
    passing: Option<Passing<'a>>,
    rounds: u64,
    save_point: Option<SavePoint<'a>>,
}

/// What the front of a rank knows beside its field, of the bricks that the rank owns.
#[derive(Serialize, Deserialize)]
struct Known {
    rounds: u64,
    /// The round that is under way; between two there is none.
    within: Option<Place>,
    /// Bricks that something enters, and the smallest value that does.
    due: Vec<(BrickId, f64)>,
    unsent: Vec<BrickId>,
}

/// The smallest value that enters each brick beside one, in the order of `offsets`; infinite where none does.
type Outgoing = [f64; NEIGHBOURS_26.len()];

impl<M: DistanceMethod> Front<'_, M> {
    /// Goes on where an earlier run was ended, on as many ranks as that had, and returns where in a round that was: the field, and what
    /// is due, are all that what comes depends on. Bricks that had come to rest before that run ended are not shown as passed again; they
    /// are read out at the end.
    fn resume(&mut self, exchange: &Exchange<'_>) -> Result<Option<Place>> {
        let Some(saved) = self.save_point.as_ref().and_then(SavePoint::saved) else { return Ok(None) };
        let (set, mut within) = (self.array.set().clone(), None);
        self.arrival.fill(f64::INFINITY);
        self.unsent.fill(false);
        for known in saved.facts_of_all::<Known>()? {
            // All were in the same round, and in the midst of one is a rank that is alone.
            (self.rounds, within) = (known.rounds, known.within);
            for (slot, arrival) in known.due.iter().filter_map(|&(id, arrival)| Some((set.own_slot(id)?, arrival))) {
                self.arrival[slot as usize] = arrival;
            }
            known.unsent.iter().filter_map(|&id| set.own_slot(id)).for_each(|slot| self.unsent[slot as usize] = true);
        }
        saved.restore(0, self.array)?;
        exchange.faces(self.array, &set.owned().collect::<Vec<_>>())?;
        self.passing = None;
        Ok(within)
    }

    fn known(&self, within: Option<Place>) -> Known {
        let set = self.array.set();
        let due = set.owned().map(|slot| (set.id(slot), self.arrival[slot as usize]));
        let unsent = set.owned().filter(|&slot| self.unsent[slot as usize]).map(|slot| set.id(slot));
        let due = due.filter(|(_, arrival)| arrival.is_finite()).collect();
        Known { rounds: self.rounds, within, due, unsent: unsent.collect() }
    }

    /// Between two rounds, or within one.
    fn put_by(&mut self, ended: bool, within: Option<Place>) -> Result<()> {
        let Some(mut save_point) = self.save_point.take() else { return Ok(()) };
        save_point.reached(ended, || self.known(within), &[self.array])?;
        self.save_point = Some(save_point);
        Ok(())
    }

    fn outgoing(&self, tile: &HaloTile<M::State>, slot: Slot, part: &Box3) -> Outgoing {
        let mut values = [f64::INFINITY; NEIGHBOURS_26.len()];
        let written = !self.unsent[slot as usize] && self.array.unwritten(slot).is_none();
        for (value, (n, &offset)) in values.iter_mut().zip(self.offsets.iter().enumerate()) {
            let found = match (self.method.neighbours(), written) {
                (Neighbours::All, _) => outgoing_anywhere(self.method, tile, part, offset),
                (Neighbours::Faces, false) => outgoing(self.method, tile, part, FACES[n], None),
                // Only what is new on a face can lower a voxel beyond it.
                (Neighbours::Faces, true) => self
                    .array
                    .read_face(slot, FACES[n], |ghosts| outgoing(self.method, tile, part, FACES[n], Some(ghosts))),
            };
            *value = found.unwrap_or(f64::INFINITY);
        }
        values
    }
}

impl<M: DistanceMethod> Relax for Front<'_, M> {
    type State = M::State;
    type Work = (HaloTile<M::State>, M::Work);
    type Visit = Option<Outgoing>;
    type Note = Outgoing;

    fn field(&self) -> &BrickArray<M::State> {
        self.array
    }

    fn priority(&self, slot: Slot) -> f64 {
        self.arrival[slot as usize]
    }

    fn visit(&self, (tile, work): &mut Self::Work, slot: Slot, _wave: usize) -> Result<Option<Outgoing>> {
        self.plan.gather(self.array, slot, Boundary::Constant(M::UNKNOWN), tile);
        let part = self.array.set().grid().brick_box(self.array.set().id(slot));
        let changed = self.method.settle(tile, work, &part);
        let outgoing = (changed || self.unsent[slot as usize]).then(|| self.outgoing(tile, slot, &part));
        if changed {
            self.plan.scatter(tile, self.array, slot);
        }
        Ok(outgoing)
    }

    fn note(&self, _slot: Slot, visit: &Option<Outgoing>) -> Option<Outgoing> {
        *visit
    }

    fn before_round(&mut self, nearest: f64) -> Result<()> {
        self.put_by(false, None)?;
        self.rounds += 1;
        self.passing.as_mut().map_or(Ok(()), |passing| passing.reach(self.array.set(), nearest))
    }

    fn visited(&mut self, slot: Slot, visit: Option<Outgoing>) {
        if let Some(passing) = &mut self.passing {
            passing.visited(slot, self.arrival[slot as usize], visit.is_some());
        }
        (self.arrival[slot as usize], self.unsent[slot as usize]) = (f64::INFINITY, false);
    }

    /// A brick that was visited is not due any more, so what is due tells which of a wave are still to come.
    fn pauses_after(&self) -> Option<usize> {
        let save_point = self.save_point.as_ref().filter(|save_point| save_point.is_alone());
        save_point.map(|_| bricks_between_pauses(self.array.set()))
    }

    fn paused(&mut self, at: Place) -> Result<()> {
        self.put_by(false, Some(at))
    }

    fn receive(&mut self, slot: Slot, outgoing: &Outgoing) {
        let set = self.array.set();
        for (&offset, &value) in self.offsets.iter().zip(outgoing) {
            if let Some(beside) = set.neighbour(slot, offset) {
                let arrival = &mut self.arrival[beside as usize];
                *arrival = arrival.min(value);
            }
        }
    }
}
