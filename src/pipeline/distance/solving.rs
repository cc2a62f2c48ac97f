//! The distance methods on bricks: which kernel by which schedule, and the steps that methods share.

use std::sync::{Arc, OnceLock};

use super::medium::Medium;
use super::readout::early::Early;
use super::readout::field::{Solved, Values};
use super::readout::repair::looked_over;
use super::schedule::front::advance_front;
use super::schedule::passing::{Passed, Watch};
use super::schedule::sweep::{NoCompanion, sweep_all};
use super::schedule::sweep_sources::TrackedSweeps;
use super::schedule::textbook::{Wanted, heap_dijkstra, heap_marching};
use super::schedule::trace::{SourceField, trace_sources};
use super::seeding::initialise::{Seeded, Start, initialise};
use super::seeding::outside::search_outside;
use super::through::Through;
use super::{Options, Schedule, Sources};
use crate::error::{Error, Result};
use crate::exec::{Engine, Stage, Workers, borrow_bricks};
use crate::grid::{BrickId, BrickSet, DataSets, SourceState};
use crate::kernel::distance::methods::all_neighbours::AllNeighbours;
use crate::kernel::distance::methods::dijkstra_pythagoras::DijkstraPythagoras;
use crate::kernel::distance::methods::fast_marching::FastMarching;
use crate::kernel::distance::methods::fast_sweeping::FastSweeping;
use crate::kernel::distance::methods::shape_distance::ShapeDistance;
use crate::kernel::distance::methods::tracked::TrackedSource;
use crate::kernel::distance::methods::vector_distance::VectorDistance;
use crate::kernel::distance::repair::bends::REACH;
use crate::kernel::distance::state::method::{DistanceMethod, DistanceState, OrderedSweeps};
use crate::kernel::distance::state::neighbours::Neighbours;
use crate::kernel::distance::state::precision::Precision;
use crate::kernel::distance::tracking::parents::{Parents, ShortestWay, UpwindSum};
use crate::store::BrickArray;

/// What a method is given: sources, and the bricks of one rank.
pub struct Solving<'j, 'a, P> {
    /// Counts, and tells of an interruption.
    pub stage: &'j Stage<'j>,
    /// The rank's engine.
    pub engine: &'j Engine,
    /// To what the distance is.
    pub sources: &'j Sources<'a>,
    /// The rank's bricks.
    pub set: &'j Arc<BrickSet>,
    /// What is wanted beside or instead of the usual.
    pub options: Options,
    /// Who reads bricks out while others are still solved.
    pub early: Option<&'j dyn Early<P>>,
    /// Bricks of other ranks that are read here when all is solved, in order.
    pub borrows: &'j [BrickId],
}

/// Who reads out early, and what from.
struct Reading<'r, 'a, P> {
    early: &'r dyn Early<P>,
    solved: Solved<'a, P>,
}

impl<P: Precision> Watch for Reading<'_, '_, P> {
    fn passed(&self, passed: &Passed<'_>) -> Result<()> {
        self.early.passed(passed, &self.solved)
    }

    fn reopened(&self) {
        self.early.reopened();
    }
}

/// Fast sweeping.
pub(super) fn fast_sweeping<'a, P: Precision>(job: &Solving<'_, 'a, P>, schedule: Schedule) -> Result<Solved<'a, P>> {
    let spacing = job.sources.geometry.spacing;
    if let Some(medium) = job.sources.medium {
        // In f64 either way: what rounds to f32 then is the same in whatever order bricks come.
        let method = Through { method: FastSweeping::<P, f64, true>::new(spacing), medium };
        return match schedule {
            Schedule::Front => job.front_then_sources::<_, UpwindSum>(method),
            Schedule::Sweep { iterations } => job.sweeps_then_sources(method, iterations),
        };
    }
    match schedule {
        Schedule::Front => job.front_then_sources::<_, UpwindSum>(FastSweeping::<P, P::Fast>::new(spacing)),
        Schedule::Sweep { iterations } => job.sweeps_with_sources(FastSweeping::<P, f64>::new(spacing), iterations),
    }
}

/// The vector distance transform.
pub(super) fn vector_distance<'a, P: Precision>(job: &Solving<'_, 'a, P>, schedule: Schedule) -> Result<Solved<'a, P>> {
    let (geometry, positions) = (job.sources.geometry, job.sources.positions);
    if let Some(sets) = job.sources.shapes() {
        let method = ShapeDistance::new(geometry, sets);
        return match schedule {
            Schedule::Front => job.front_vector(method),
            Schedule::Sweep { iterations } => job.sweeps(method, iterations),
        };
    }
    match schedule {
        Schedule::Front => job.front_vector(VectorDistance::<P::Fast>::new(geometry, positions)),
        Schedule::Sweep { iterations } => job.sweeps(VectorDistance::<f64>::new(geometry, positions), iterations),
    }
}

/// Fast marching.
pub(super) fn fast_marching<'a, P: Precision>(job: &Solving<'_, 'a, P>, schedule: Schedule) -> Result<Solved<'a, P>> {
    let (geometry, positions) = (job.sources.geometry, job.sources.positions);
    let method = FastMarching::<P, P::Fast>::new(geometry.spacing);
    if let (Some(medium), Schedule::Front) = (job.sources.medium, schedule) {
        let method = Through { method: FastMarching::<P, f64, true>::new(geometry.spacing), medium };
        return job.front_then_sources::<_, UpwindSum>(method);
    }
    match (schedule, job.sources.shapes()) {
        (Schedule::Front, _) => job.front_then_sources::<_, ShortestWay>(method),
        (_, Some(sets)) => job.heap_marching(method, &ShapeDistance::new(geometry, sets)),
        (_, None) => job.heap_marching(method, &VectorDistance::<f64>::new(geometry, positions)),
    }
}

/// Dijkstra-Pythagoras.
pub(super) fn dijkstra_pythagoras<'a, P: Precision>(
    job: &Solving<'_, 'a, P>,
    schedule: Schedule,
) -> Result<Solved<'a, P>> {
    let (geometry, positions) = (job.sources.geometry, job.sources.positions);
    match (schedule, job.sources.shapes()) {
        (Schedule::Front, Some(sets)) => job.front_dijkstra(ShapeDistance::new(geometry, sets)),
        (Schedule::Front, None) => job.front_dijkstra(VectorDistance::<P::Fast>::new(geometry, positions)),
        (_, Some(sets)) => job.heap_dijkstra(ShapeDistance::new(geometry, sets)),
        (_, None) => job.heap_dijkstra(VectorDistance::<f64>::new(geometry, positions)),
    }
}

/// Nothing is made of the distance beside it.
#[expect(clippy::unnecessary_wraps, reason = "what else is made of it may fail")]
fn nothing() -> Result<()> {
    Ok(())
}

impl<'j, 'a, P: Precision> Solving<'j, 'a, P> {
    /// What a rank is given that reads nothing of others, and that nobody watches.
    #[must_use]
    pub fn new(
        stage: &'j Stage<'j>,
        engine: &'j Engine,
        sources: &'j Sources<'a>,
        set: &'j Arc<BrickSet>,
        options: Options,
    ) -> Self {
        Self { stage, engine, sources, set, options, early: None, borrows: &[] }
    }

    /// Lengths of the sides of a voxel, or about the times that a front takes along them: what it is scheduled by.
    fn steps(&self) -> [f64; 3] {
        let slowness = self.sources.medium.map_or(1.0, Medium::slowness);
        self.sources.geometry.spacing.map(|h| h * slowness)
    }

    /// A method's start: its state with the voxels that sources fix.
    fn start<M: DistanceState>(&self, start: Start) -> Result<(BrickArray<M::State>, Seeded)> {
        let state = BrickArray::blank(self.engine.scratch(), self.set, M::UNKNOWN)?;
        let seeded = initialise::<M>(self.stage, self.sources, &state, None, (start, self.options.farthest))?;
        self.check_begun(&seeded)?;
        Ok((state, seeded))
    }

    /// The start of a method that keeps no sources, and a field with those of its fixed voxels.
    fn start_apart<M: DistanceState>(&self) -> Result<(BrickArray<M::State>, BrickArray<SourceState>, Seeded)> {
        let state = BrickArray::blank(self.engine.scratch(), self.set, M::UNKNOWN)?;
        let sources = BrickArray::blank(self.engine.scratch(), self.set, SourceState::FAR)?;
        let seeded =
            initialise::<M>(self.stage, self.sources, &state, Some(&sources), (Start::Fixed, self.options.farthest))?;
        self.check_begun(&seeded)?;
        Ok((state, sources, seeded))
    }

    /// Refuses sources from which no front begins.
    fn check_begun(&self, seeded: &Seeded) -> Result<()> {
        if self.sources.medium.is_none() || self.stage.comm().any(!seeded.bricks.is_empty())? {
            return Ok(());
        }
        Err(Error::input(
            "no front begins: all sources lie outside of the image of speeds, or beside voxels whose speed is 0 alone; look at \
             where they lie on its grid (--origin, --image-spacing, --points-in)",
        ))
    }

    fn front<M: DistanceMethod + 'a>(&self, method: M) -> Result<Solved<'a, P>> {
        let (state, seeded) = self.start::<M>(Start::Provisional)?;
        let geometry = self.sources.geometry;
        // Where sources are looked at again, those beyond the last voxel that counts are asked too.
        let beyond = if M::trial(0).is_some() { geometry.length([REACH; 3]) } else { 0.0 };
        let farthest = self.options.farthest + beyond;
        let bounds = (self.steps(), farthest);
        let values = self.values(method, state);
        let (method, state) = (&values.method, &values.state);
        // Nobody knows how long a detour around what nothing passes may take.
        match self.early.filter(|_| self.sources.outside.is_none() && self.sources.medium.is_none()) {
            Some(early) => {
                let solved = values.read::<P>(seeded.fixed_voxels, seeded.triangle_distances);
                let tracks = M::trial(0).is_some();
                let solved = looked_over(solved, self.sources, self.options, (tracks, Schedule::Front));
                let reading = Reading { early, solved };
                advance_front(self.stage, method, state, &seeded.bricks, bounds, Some(&reading), nothing)?;
            }
            None => advance_front(self.stage, method, state, &seeded.bricks, bounds, None, nothing)?,
        }
        search_outside(self.stage, self.sources, method, state, self.options.farthest)?;
        self.borrow_for(&values)?;
        Ok(values.read(seeded.fixed_voxels, seeded.triangle_distances))
    }

    fn sweeps<M: OrderedSweeps + 'a>(&self, method: M, iterations: u32) -> Result<Solved<'a, P>> {
        let (state, seeded) = self.start::<M>(Start::Fixed)?;
        sweep_all(self.stage, &method, &state, &mut NoCompanion(self.set), &seeded.bricks, iterations, nothing)?;
        search_outside(self.stage, self.sources, &method, &state, self.options.farthest)?;
        self.solved(method, state, &seeded)
    }

    /// Distances, and along with them their sources, where these are asked for.
    fn sweeps_with_sources(&self, method: FastSweeping<P, f64>, iterations: u32) -> Result<Solved<'a, P>> {
        if !self.options.sources {
            return self.sweeps(method, iterations);
        }
        if self.labelled().is_some() {
            // An update that lowers nothing is none, so sweeps do not see that another label is as near.
            return self.sweeps_then_sources(method, iterations);
        }
        let (state, sources, seeded) = self.start_apart::<FastSweeping<P, f64>>()?;
        let mut tracked = TrackedSweeps::new(self.stage, self.engine.scratch(), &sources, &seeded.bricks)?;
        sweep_all(self.stage, &method, &state, &mut tracked, &seeded.bricks, iterations, nothing)?;
        drop(tracked);
        Ok(Solved { sources: self.source_field(sources)?, ..self.solved(method, state, &seeded)? })
    }

    /// Distances by sweeps, and then their sources, where these are asked for.
    fn sweeps_then_sources<M: OrderedSweeps<State = P> + 'a>(
        &self,
        method: M,
        iterations: u32,
    ) -> Result<Solved<'a, P>> {
        if !self.options.sources {
            return self.sweeps(method, iterations);
        }
        let (state, sources, seeded) = self.start_apart::<M>()?;
        let trace = || self.trace::<UpwindSum>(&state, &sources, &seeded);
        sweep_all(self.stage, &method, &state, &mut NoCompanion(self.set), &seeded.bricks, iterations, trace)?;
        Ok(Solved { sources: self.source_field(sources)?, ..self.solved(method, state, &seeded)? })
    }

    /// Distances, and then their sources, where these are asked for.
    fn front_then_sources<M: DistanceMethod<State = P> + 'a, R: Parents>(&self, method: M) -> Result<Solved<'a, P>> {
        if !self.options.sources {
            return self.front(method);
        }
        let (state, sources, seeded) = self.start_apart::<M>()?;
        let bounds = (self.steps(), self.options.farthest);
        let trace = || self.trace::<R>(&state, &sources, &seeded);
        advance_front(self.stage, &method, &state, &seeded.bricks, bounds, None, trace)?;
        Ok(Solved { sources: self.source_field(sources)?, ..self.solved(method, state, &seeded)? })
    }

    /// The data sets, where labels are wanted and these are several.
    fn labelled(&self) -> Option<&'a DataSets> {
        self.sources.labelled().filter(|_| self.options.labels)
    }

    fn trace<R: Parents>(
        &self,
        state: &BrickArray<P>,
        sources: &BrickArray<SourceState>,
        seeded: &Seeded,
    ) -> Result<()> {
        let (through, labelled) = ((self.sources.geometry, self.sources.medium), self.labelled());
        trace_sources::<P, R>(self.stage, through, labelled, state, sources, &seeded.bricks)
    }

    fn front_vector<S: DistanceMethod + TrackedSource + 'a>(&self, sources: S) -> Result<Solved<'a, P>> {
        match self.options.neighbours {
            Neighbours::Faces => self.front(sources),
            Neighbours::All => self.front(AllNeighbours::new(sources)),
        }
    }

    fn front_dijkstra<S: TrackedSource + 'a>(&self, sources: S) -> Result<Solved<'a, P>> {
        self.front(DijkstraPythagoras::new(self.sources.geometry, self.options.neighbours, sources))
    }

    fn heap_dijkstra<S: TrackedSource<Number = f64> + 'a>(&self, method: S) -> Result<Solved<'a, P>> {
        let (state, seeded) = self.start::<S>(Start::Fixed)?;
        heap_dijkstra(self.engine, self.sources.geometry, &method, self.options.neighbours, &state)?;
        search_outside(self.stage, self.sources, &method, &state, self.options.farthest)?;
        self.solved(method, state, &seeded)
    }

    fn heap_marching<M: DistanceState<State = P> + 'a, S: TrackedSource>(
        &self,
        method: M,
        start: &S,
    ) -> Result<Solved<'a, P>> {
        let (sources, seeded) = self.start::<S>(Start::Fixed)?;
        let state = BrickArray::blank(self.engine.scratch(), self.set, P::UNKNOWN)?;
        let medium = self.sources.medium;
        let along = self.options.sources && medium.is_none();
        let wanted = Wanted { sources: along, labelled: self.labelled(), medium };
        heap_marching(self.engine, self.sources.geometry, start, wanted, &state, &sources)?;
        if self.options.sources && medium.is_some() {
            self.set.owned().for_each(|slot| state.refresh_faces(slot));
            self.trace::<UpwindSum>(&state, &sources, &seeded)?;
        }
        Ok(Solved { sources: self.source_field(sources)?, ..self.solved(method, state, &seeded)? })
    }

    fn solved<M: DistanceState + 'a>(
        &self,
        method: M,
        state: BrickArray<M::State>,
        seeded: &Seeded,
    ) -> Result<Solved<'a, P>> {
        let values = self.values(method, state);
        self.borrow_for(&values)?;
        Ok(values.read(seeded.fixed_voxels, seeded.triangle_distances))
    }

    fn values<M: DistanceState + 'a>(&self, method: M, state: BrickArray<M::State>) -> Arc<Values<M>> {
        let (farthest, buffers) = (self.options.farthest, Workers::new(Vec::new));
        Arc::new(Values { method, state, borrowed: OnceLock::new(), farthest, buffers })
    }

    /// Gets what is read of other ranks' bricks, which are solved too.
    fn borrow_for<M: DistanceState>(&self, values: &Values<M>) -> Result<()> {
        if let Some(bricks) = borrow_bricks(self.stage, &values.state, M::UNKNOWN, self.borrows)? {
            let _ = values.borrowed.set(bricks);
        }
        Ok(())
    }

    fn source_field(&self, sources: BrickArray<SourceState>) -> Result<Arc<SourceField>> {
        let borrowed = borrow_bricks(self.stage, &sources, SourceState::FAR, self.borrows)?;
        Ok(Arc::new(SourceField(sources, borrowed)))
    }
}
