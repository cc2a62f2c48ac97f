//! Sources for methods that keep distances only, in a field of their own: for the `front` schedule found after the
//! distances (`kernel::distance::tracking::trace`), for `sweep` what `sweep_sources` left pending.
//!
//! Bricks in which something may be found come first, then those beside bricks in which something was, as long as any
//! is missing there: of these the nearest to the sources, since chains come from there and the others would wait for
//! them. Bricks with a face, edge or corner in common never run at the same time, so what a round does not
//! depend on threads; what is found does not even depend on the rounds.

use std::marker::PhantomData;

use crate::error::Result;
use crate::exec::{
    Boundary, Exchange, HaloPlan, Reach, Relax, Stage, Until, Waves, Workers, corner_colours, read_with_borrowed,
};
use crate::grid::{Box3, DataSets, Geometry, NEIGHBOURS_26, Slot, SourceState};
use crate::kernel::distance::state::precision::Precision;
use crate::kernel::distance::tracking::parents::Parents;
use crate::kernel::distance::tracking::trace::{Tracer, fill};
use crate::pipeline::distance::medium::Medium;
use crate::store::{BoxSource, BrickArray};
use crate::tile::HaloTile;

/// Carries sources from the fixed voxels on the bricks in `start` along finished distances; of equally good ones those
/// of the lowest label, where there are data sets with labels.
pub(crate) fn trace_sources<P: Precision, R: Parents>(
    stage: &Stage<'_>,
    (geometry, medium): (&Geometry, Option<&Medium>),
    labelled: Option<&DataSets>,
    distances: &BrickArray<P>,
    states: &BrickArray<SourceState>,
    start: &[Slot],
) -> Result<()> {
    let set = distances.set().clone();
    let plan = HaloPlan::new(*set.grid(), Reach::All);
    let edge = set.grid().edge() as usize;
    let exchange = &Exchange::new(stage.comm(), &set, &plan)?;
    exchange.faces(distances, &set.owned().collect::<Vec<_>>())?;
    exchange.faces(states, start)?;
    let tracer = Tracer::<R>::new(geometry, edge);
    let of_speeds = if medium.is_some() { edge } else { 0 };
    let workers =
        &Workers::new(move || (HaloTile::new(edge), HaloTile::new(edge), HaloTile::new(of_speeds), tracer.clone()));
    let waves = &corner_colours(&set);
    let waves = Waves { stage, exchange, workers, waves };
    let gather = |distance: &mut HaloTile<P>, state: &mut HaloTile<SourceState>, slot: Slot| {
        plan.gather(distances, slot, Boundary::Constant(P::UNKNOWN), distance);
        plan.gather(states, slot, Boundary::Constant(SourceState::FAR), state);
    };
    let trace = |(distance, state, speeds, tracer): &mut (_, _, _, Tracer<R>), slot| {
        gather(distance, state, slot);
        if let Some(medium) = medium {
            medium.put(slot, speeds);
        }
        let (found, left) = tracer.trace(labelled, (distance, medium.map(|_| &*speeds)), state);
        if found {
            plan.scatter(state, states, slot);
        }
        (found, left)
    };
    let complete = (0..set.len() as Slot).map(|slot| distances.unwritten(slot).is_some()).collect();
    let mut missing = Missing::new(states, complete, trace);
    missing.far = middles(distances)?;
    missing.begin(start, true);
    let window = edge as f64 * geometry.max_spacing() * medium.map_or(1.0, Medium::slowness);
    waves.relax(&mut missing, Until { width: window, ..Until::QUIET })?;
    let complete = missing.complete;
    let left: Vec<Slot> = set.owned().filter(|&slot| !complete[slot as usize]).collect();
    if !stage.comm().any(!left.is_empty())? {
        return Ok(());
    }
    let fill = |(distance, state, ..): &mut (_, _, HaloTile<f32>, Tracer<R>), slot| {
        gather(distance, state, slot);
        let (changed, left) = fill(distance, state);
        if changed {
            plan.scatter(state, states, slot);
        }
        (changed, left)
    };
    let mut missing = Missing::new(states, complete, fill);
    missing.begin(&left, false);
    waves.relax(&mut missing, Until::QUIET)?;
    Ok(())
}

/// Bricks in which sources are missing, and how some are found: `visit` finds what it can in a brick; it tells whether
/// it found anything, and whether anything is left.
pub(crate) struct Missing<'a, W, F> {
    states: &'a BrickArray<SourceState>,
    visit: F,
    /// Bricks in which something may be found.
    dirty: Vec<bool>,
    /// Nobody was told of what these bricks hold yet.
    unsent: Vec<bool>,
    /// Bricks in which nothing is missing.
    complete: Vec<bool>,
    /// How far from the sources bricks are: about in this order they are visited.
    far: Vec<f64>,
    work: PhantomData<fn(W)>,
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

impl<'a, W, F: Fn(&mut W, Slot) -> (bool, bool) + Sync> Missing<'a, W, F> {
    pub(crate) fn new(states: &'a BrickArray<SourceState>, complete: Vec<bool>, visit: F) -> Self {
        let bricks = complete.len();
        let (dirty, unsent) = (vec![false; bricks], vec![false; bricks]);
        Self { states, visit, dirty, unsent, complete, far: vec![0.0; bricks], work: PhantomData }
    }

    /// Makes bricks due; with `unsent` also those beside them, afterwards, whether anything is found in them or not.
    pub(crate) fn begin(&mut self, start: &[Slot], unsent: bool) {
        for &slot in start {
            (self.dirty[slot as usize], self.unsent[slot as usize]) = (true, unsent);
        }
    }
}

impl<W: Send, F: Fn(&mut W, Slot) -> (bool, bool) + Sync> Relax for Missing<'_, W, F> {
    type State = SourceState;
    type Work = W;
    type Visit = (bool, bool);
    type Note = [f64; 0];

    fn field(&self) -> &BrickArray<SourceState> {
        self.states
    }

    fn priority(&self, slot: Slot) -> f64 {
        let at = slot as usize;
        if self.dirty[at] && !self.complete[at] { self.far[at] } else { f64::INFINITY }
    }

    fn visit(&self, work: &mut W, slot: Slot, _wave: usize) -> Result<(bool, bool)> {
        Ok((self.visit)(work, slot))
    }

    fn note(&self, slot: Slot, (found, _): &(bool, bool)) -> Option<[f64; 0]> {
        (*found || self.unsent[slot as usize]).then_some([])
    }

    fn visited(&mut self, slot: Slot, (_, left): (bool, bool)) {
        let at = slot as usize;
        (self.dirty[at], self.unsent[at], self.complete[at]) = (false, false, !left);
    }

    fn receive(&mut self, slot: Slot, _note: &[f64; 0]) {
        let set = self.states.set();
        let beside = NEIGHBOURS_26.iter().filter_map(|&offset| set.neighbour(slot, offset));
        beside.for_each(|n| self.dirty[n as usize] = true);
    }
}

/// A field of states, read as the indices of sources; and bricks of it that other ranks own, where these are read.
pub(crate) struct SourceField(pub(crate) BrickArray<SourceState>, pub(crate) Option<BrickArray<SourceState>>);

impl BoxSource<u32> for SourceField {
    fn shape(&self) -> [i64; 3] {
        self.0.set().grid().shape()
    }

    fn read_box(&self, part: &Box3, out: &mut [u32]) -> Result<()> {
        // Two words of 32 bits for each voxel of a small box; the states themselves are not what is handed out.
        let mut states = vec![SourceState::FAR; out.len()];
        read_with_borrowed(&self.0, self.1.as_ref(), part, &mut states)?;
        out.iter_mut().zip(states).for_each(|(out, state)| *out = state.source());
        Ok(())
    }
}
