//! Sources for methods that keep distances only, in a field of their own: for the `front` schedule found after the
//! distances (`kernel::distance::tracking::trace`), for `sweep` what `sweep_sources` left pending.
//!
//! Bricks in which something may be found come first, then those beside bricks in which something was, as long as any
//! is missing there: of these the nearest to the sources, since chains come from there and the others would wait for
//! them. Bricks with a face, edge or corner in common never run at the same time, so what a round does not
//! depend on threads; what is found does not even depend on the rounds.

use crate::error::Result;
use crate::exec::{Boundary, Exchange, HaloPlan, Reach, Stage, Workers};
use crate::grid::{Box3, DataSets, Geometry, NEIGHBOURS_26, Slot};
use crate::kernel::distance::state::precision::Precision;
use crate::kernel::distance::state::source::FIXED;
use crate::kernel::distance::state::source::NO_SOURCE;
use crate::kernel::distance::tracking::parents::Parents;
use crate::kernel::distance::tracking::trace::{Tracer, fill};
use crate::store::{BoxSource, BrickArray};
use crate::tile::HaloTile;

/// Carries sources from the fixed voxels on the bricks in `start` along finished distances; of equally good ones those
/// of the lowest label, where there are data sets with labels.
pub(crate) fn trace_sources<P: Precision, R: Parents>(
    stage: &Stage<'_>,
    geometry: &Geometry,
    labelled: Option<&DataSets>,
    distances: &BrickArray<P>,
    states: &BrickArray<u32>,
    start: &[Slot],
) -> Result<()> {
    let set = distances.set().clone();
    let plan = HaloPlan::new(*set.grid(), Reach::All);
    let edge = set.grid().edge() as usize;
    let exchange = Exchange::new(stage.comm(), &set, &plan)?;
    exchange.faces(distances, &set.owned().collect::<Vec<_>>())?;
    exchange.faces(states, start)?;
    let tracer = Tracer::<R>::new(geometry, edge);
    let workers = Workers::new(move || (HaloTile::new(edge), HaloTile::new(edge), tracer.clone()));
    let gather = |distance: &mut HaloTile<P>, state: &mut HaloTile<u32>, slot: Slot| {
        plan.gather(distances, slot, Boundary::Constant(P::UNKNOWN), distance);
        plan.gather(states, slot, Boundary::Constant(NO_SOURCE), state);
    };
    let complete = (0..set.len() as Slot).map(|slot| distances.unwritten(slot).is_some()).collect();
    let mut rounds = Rounds::new(states, &exchange, complete);
    rounds.order(middles(distances)?, edge as f64 * geometry.max_spacing());
    rounds.begin(start, true);
    rounds.run(stage, &workers, |(distance, state, tracer), slot| {
        gather(distance, state, slot);
        let (found, left) = tracer.trace(labelled, distance, state);
        if found {
            plan.scatter(state, states, slot);
        }
        (found, left)
    })?;
    let left: Vec<Slot> = set.owned().filter(|&slot| !rounds.complete[slot as usize]).collect();
    if !stage.comm().any(!left.is_empty())? {
        return Ok(());
    }
    rounds.begin(&left, false);
    rounds.run(stage, &workers, |(distance, state, _), slot| {
        gather(distance, state, slot);
        let (changed, filled) = fill(distance, state);
        if changed {
            plan.scatter(state, states, slot);
        }
        (changed, filled)
    })
}

/// Rounds over bricks that are due, until none is.
pub(crate) struct Rounds<'a> {
    states: &'a BrickArray<u32>,
    exchange: &'a Exchange<'a>,
    /// 0 for bricks that are due, else infinite: what ranks tell each other.
    due: Vec<f64>,
    /// Nobody was told of what these bricks hold yet.
    untold: Vec<bool>,
    /// Bricks in which nothing is missing.
    complete: Vec<bool>,
    /// How far from the sources bricks are, and by how much they may be farther than the nearest that is due.
    far: Vec<f64>,
    window: f64,
}

/// The distance in the middle of each brick of this rank; 0 for others.
fn middles<P: Precision>(distances: &BrickArray<P>) -> Result<Vec<f64>> {
    let set = distances.set();
    let mut middles = vec![0.0; set.len()];
    for slot in set.owned() {
        let part = set.grid().brick_box(set.id(slot));
        let lo = std::array::from_fn(|a| i64::midpoint(part.lo[a], part.hi[a]));
        let mut middle = [P::default()];
        distances.read_box(&Box3::new(lo, lo.map(|v| v + 1)), &mut middle)?;
        // No brick waits for ever.
        middles[slot as usize] = middle[0].to_f64().abs().min(f64::MAX);
    }
    Ok(middles)
}

impl<'a> Rounds<'a> {
    pub(crate) fn new(states: &'a BrickArray<u32>, exchange: &'a Exchange<'a>, complete: Vec<bool>) -> Self {
        let bricks = complete.len();
        let (due, untold) = (vec![f64::INFINITY; bricks], vec![false; bricks]);
        Self { states, exchange, due, untold, complete, far: vec![0.0; bricks], window: 0.0 }
    }

    /// Visits bricks in about the order of how `far` they are, those within a `window` together.
    fn order(&mut self, far: Vec<f64>, window: f64) {
        (self.far, self.window) = (far, window);
    }

    /// Makes bricks due; with `untold` also those beside them, afterwards, whether anything is found in them or not.
    pub(crate) fn begin(&mut self, start: &[Slot], untold: bool) {
        for &slot in start {
            (self.due[slot as usize], self.untold[slot as usize]) = (0.0, untold);
        }
    }

    /// `visit` finds what it can in a brick; it tells whether it found anything, and whether anything is left.
    pub(crate) fn run<W: Send>(
        &mut self,
        stage: &Stage<'_>,
        workers: &Workers<W>,
        visit: impl Fn(&mut W, Slot) -> (bool, bool) + Sync,
    ) -> Result<()> {
        let set = self.states.set().clone();
        let colour = |slot: Slot| set.grid().coords(set.id(slot)).iter().fold(0, |colour, at| colour << 1 | (at & 1));
        loop {
            let due = set.owned().filter(|&slot| self.due[slot as usize] == 0.0);
            let nearest = due.fold(f64::INFINITY, |least, slot| least.min(self.far[slot as usize]));
            let nearest = stage.comm().least(nearest)?;
            if nearest == f64::INFINITY {
                return Ok(());
            }
            for turn in 0..8 {
                let is_due = |slot: &Slot| {
                    let at = *slot as usize;
                    self.due[at] == 0.0 && self.far[at] <= nearest + self.window && colour(*slot) == turn
                };
                let wave: Vec<Slot> = set.owned().filter(is_due).collect();
                let visited = stage.run(&wave, workers, |work, &slot| Ok(visit(work, slot)))?;
                for (&slot, (found, left)) in wave.iter().zip(visited) {
                    self.due[slot as usize] = f64::INFINITY;
                    self.complete[slot as usize] = !left;
                    if found || std::mem::take(&mut self.untold[slot as usize]) {
                        let beside = NEIGHBOURS_26.iter().filter_map(|&offset| set.neighbour(slot, offset));
                        beside.for_each(|n| self.due[n as usize] = 0.0);
                    }
                }
                self.exchange.faces(self.states, &wave)?;
                self.exchange.lowest(&mut self.due)?;
                for slot in set.owned().filter(|&slot| self.complete[slot as usize]) {
                    self.due[slot as usize] = f64::INFINITY;
                }
            }
        }
    }
}

/// A field of states, read as the indices of sources.
pub(crate) struct SourceField(pub(crate) BrickArray<u32>);

impl BoxSource<u32> for SourceField {
    fn shape(&self) -> [i64; 3] {
        self.0.set().grid().shape()
    }

    fn read_box(&self, part: &Box3, out: &mut [u32]) -> Result<()> {
        self.0.read_box(part, out)?;
        for state in out {
            *state &= !FIXED;
        }
        Ok(())
    }
}
