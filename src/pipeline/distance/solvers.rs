//! The table of distance methods. A method is one file in `kernel::distance` and one row here; the command line, its
//! help and the shared tests pick it up from the table.

use std::sync::Arc;

use super::field::{Solved, Values};
use super::front::advance_front;
use super::initialise::{Seeded, Start, initialise};
use super::look_outside::look_outside;
use super::sweep::{Alone, sweep_all};
use super::sweep_sources::TrackedSweeps;
use super::textbook::{Wanted, heap_dijkstra, heap_marching};
use super::trace::{SourceField, trace_sources};
use super::{Options, Schedule, Sources};
use crate::error::Result;
use crate::exec::{Engine, Stage, Workers};
use crate::grid::{BrickGrid, BrickSet, DataSets};
use crate::kernel::distance::Neighbours;
use crate::kernel::distance::all_neighbours::AllNeighbours;
use crate::kernel::distance::dijkstra_pythagoras::DijkstraPythagoras;
use crate::kernel::distance::fast_marching::FastMarching;
use crate::kernel::distance::fast_sweeping::FastSweeping;
use crate::kernel::distance::initialise::NO_SOURCE;
use crate::kernel::distance::method::{DistanceMethod, OrderedSweeps};
use crate::kernel::distance::parents::{Parents, ShortestWay, UpwindSum};
use crate::kernel::distance::precision::Precision;
use crate::kernel::distance::second_look::REACH;
use crate::kernel::distance::shape_distance::ShapeDistance;
use crate::kernel::distance::tracked::TrackedSource;
use crate::kernel::distance::vector_distance::VectorDistance;
use crate::kernel::distance::{dijkstra_heap, marching_heap};
use crate::store::BrickArray;

/// Solves on the bricks of a set, by a schedule.
pub(super) type Solve<P> =
    for<'a> fn(&Stage<'_>, &Engine, &Sources<'a>, &Arc<BrickSet>, Schedule, Options) -> Result<Solved<'a, P>>;

/// The order of `--schedule sweep`: that of the textbook.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Textbook {
    /// Ordered sweeps, brick by brick.
    Sweeps,
    /// One heap over the whole volume in memory.
    Heap {
        /// Bytes of memory for each voxel.
        bytes: u64,
    },
}

/// One row of the table, for fields stored as `P`.
#[derive(Clone, Copy, Debug)]
pub struct Solver<P> {
    /// What `--method` calls it.
    pub name: &'static str,
    /// One line for the help.
    pub about: &'static str,
    /// The order in which a textbook does it.
    pub textbook: Textbook,
    /// Whether it can look at all 26 neighbours.
    pub takes_all_neighbours: bool,
    /// Edge of bricks that it is fastest with on large grids.
    pub brick: i64,
    /// Bytes of a voxel's state.
    pub state_bytes: u64,
    /// Bytes of a voxel's source, where sources are asked for and not part of the state.
    pub source_bytes: u64,
    /// Does it.
    pub solve: Solve<P>,
}

/// Edge of the bricks of grids that are too small or too thin for larger ones.
const SMALL_BRICK: i64 = 32;
/// Fewer bricks than this are a small grid: what a brick at its border stores beyond it, and that a thread waits for
/// the last brick of a wave, then cost more than larger bricks save.
const FEWEST_BRICKS: u64 = 512;

impl<P> Solver<P> {
    /// Whether a voxel's state is its nearest source, from which the distance follows.
    #[must_use]
    pub fn tracks_sources(&self) -> bool {
        self.source_bytes == 0
    }

    /// Edge of the bricks that a grid is cut into where nobody asks for another. It follows from the shape alone, so
    /// that a run can be repeated on another machine.
    #[must_use]
    pub fn brick_for(&self, shape: [i64; 3]) -> i64 {
        let bricks = |edge| BrickGrid::new(shape, edge).len();
        let stored = |edge: i64| bricks(edge) as f64 * edge.pow(3) as f64;
        // Thin grids: larger bricks would stick out of them by a quarter more.
        let sticks_out = stored(self.brick) > 1.25 * stored(SMALL_BRICK);
        if bricks(self.brick) < FEWEST_BRICKS || sticks_out { self.brick.min(SMALL_BRICK) } else { self.brick }
    }
}

/// The distance methods, in the order in which the help lists them.
#[must_use]
pub const fn solvers<P: Precision>() -> [Solver<P>; 4] {
    [
        Solver {
            name: "fsm",
            about: "fast sweeping, the Eikonal equation",
            textbook: Textbook::Sweeps,
            takes_all_neighbours: false,
            brick: 64,
            state_bytes: size_of::<P>() as u64,
            source_bytes: 4,
            solve: fast_sweeping::<P>,
        },
        Solver {
            name: "vdt",
            about: "vector distance transform, Euclidean to a tracked source",
            textbook: Textbook::Sweeps,
            takes_all_neighbours: true,
            brick: 32,
            state_bytes: 4,
            source_bytes: 0,
            solve: vector_distance::<P>,
        },
        Solver {
            name: "fmm",
            about: "fast marching, the Eikonal equation",
            textbook: Textbook::Heap { bytes: size_of::<P>() as u64 + 4 + marching_heap::SCRATCH_BYTES },
            takes_all_neighbours: false,
            brick: 32,
            state_bytes: size_of::<P>() as u64,
            source_bytes: 4,
            solve: fast_marching::<P>,
        },
        Solver {
            name: "dp",
            about: "Dijkstra-Pythagoras, Euclidean to a tracked source",
            textbook: Textbook::Heap { bytes: 4 + dijkstra_heap::SCRATCH_BYTES },
            takes_all_neighbours: true,
            brick: 32,
            state_bytes: 4,
            source_bytes: 0,
            solve: dijkstra_pythagoras::<P>,
        },
    ]
}

/// The methods for fields in f32.
pub const SOLVERS: &[Solver<f32>] = &solvers();

/// A method of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Method(usize);

impl Method {
    /// Fast sweeping.
    pub const FSM: Self = Self(0);
    /// The vector distance transform.
    pub const VDT: Self = Self(1);
    /// Fast marching.
    pub const FMM: Self = Self(2);
    /// Dijkstra-Pythagoras.
    pub const DP: Self = Self(3);

    /// What `--method` calls it.
    #[must_use]
    pub fn name(self) -> &'static str {
        SOLVERS[self.0].name
    }

    /// The method of that name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        SOLVERS.iter().position(|row| row.name == name).map(Self)
    }

    /// All methods.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..SOLVERS.len()).map(Self)
    }

    /// Its row in the table of fields stored as `P`.
    #[must_use]
    pub fn solver<P: Precision>(self) -> Solver<P> {
        solvers()[self.0]
    }
}

fn fast_sweeping<'a, P: Precision>(
    stage: &Stage<'_>,
    engine: &Engine,
    sources: &Sources<'a>,
    set: &Arc<BrickSet>,
    schedule: Schedule,
    options: Options,
) -> Result<Solved<'a, P>> {
    let job = Job { stage, engine, sources, set, options };
    let spacing = sources.geometry.spacing;
    match schedule {
        Schedule::Front => job.front_then_sources::<P, _, UpwindSum>(FastSweeping::<P, P::Fast>::new(spacing)),
        Schedule::Sweep { iterations } => job.sweeps_with_sources(FastSweeping::<P, f64>::new(spacing), iterations),
    }
}

fn vector_distance<'a, P: Precision>(
    stage: &Stage<'_>,
    engine: &Engine,
    sources: &Sources<'a>,
    set: &Arc<BrickSet>,
    schedule: Schedule,
    options: Options,
) -> Result<Solved<'a, P>> {
    let job = Job { stage, engine, sources, set, options };
    let (geometry, positions) = (sources.geometry, sources.positions);
    if let Some(sets) = sources.shapes() {
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

fn fast_marching<'a, P: Precision>(
    stage: &Stage<'_>,
    engine: &Engine,
    sources: &Sources<'a>,
    set: &Arc<BrickSet>,
    schedule: Schedule,
    options: Options,
) -> Result<Solved<'a, P>> {
    let job = Job { stage, engine, sources, set, options };
    let (geometry, positions) = (sources.geometry, sources.positions);
    let method = FastMarching::<P, P::Fast>::new(geometry.spacing);
    match (schedule, sources.shapes()) {
        (Schedule::Front, _) => job.front_then_sources::<P, _, ShortestWay>(method),
        (_, Some(sets)) => job.heap_marching(method, &ShapeDistance::new(geometry, sets)),
        (_, None) => job.heap_marching(method, &VectorDistance::<f64>::new(geometry, positions)),
    }
}

fn dijkstra_pythagoras<'a, P: Precision>(
    stage: &Stage<'_>,
    engine: &Engine,
    sources: &Sources<'a>,
    set: &Arc<BrickSet>,
    schedule: Schedule,
    options: Options,
) -> Result<Solved<'a, P>> {
    let job = Job { stage, engine, sources, set, options };
    let (geometry, positions) = (sources.geometry, sources.positions);
    match (schedule, sources.shapes()) {
        (Schedule::Front, Some(sets)) => job.front_dijkstra(ShapeDistance::new(geometry, sets)),
        (Schedule::Front, None) => job.front_dijkstra(VectorDistance::<P::Fast>::new(geometry, positions)),
        (_, Some(sets)) => job.heap_dijkstra(ShapeDistance::new(geometry, sets)),
        (_, None) => job.heap_dijkstra(VectorDistance::<f64>::new(geometry, positions)),
    }
}

/// What every method is given.
struct Job<'j, 'a> {
    stage: &'j Stage<'j>,
    engine: &'j Engine,
    sources: &'j Sources<'a>,
    set: &'j Arc<BrickSet>,
    options: Options,
}

impl<'a> Job<'_, 'a> {
    /// A method's start: its state with the voxels that sources fix.
    fn start<M: DistanceMethod>(&self, start: Start) -> Result<(BrickArray<M::State>, Seeded)> {
        let state = BrickArray::blank(self.engine.scratch(), self.set, M::UNKNOWN)?;
        let seeded = initialise::<M>(self.stage, self.sources, &state, None, (start, self.options.farthest))?;
        Ok((state, seeded))
    }

    /// The start of a method that keeps no sources, and a field with those of its fixed voxels.
    fn start_apart<M: DistanceMethod>(&self) -> Result<(BrickArray<M::State>, BrickArray<u32>, Seeded)> {
        let state = BrickArray::blank(self.engine.scratch(), self.set, M::UNKNOWN)?;
        let sources = BrickArray::blank(self.engine.scratch(), self.set, NO_SOURCE)?;
        let seeded =
            initialise::<M>(self.stage, self.sources, &state, Some(&sources), (Start::Fixed, self.options.farthest))?;
        Ok((state, sources, seeded))
    }

    fn front<P: Precision, M: DistanceMethod + 'a>(&self, method: M) -> Result<Solved<'a, P>> {
        let (state, seeded) = self.start::<M>(Start::Told)?;
        let geometry = self.sources.geometry;
        // Where sources are looked at again, those beyond the last voxel that counts are asked too.
        let beyond = if M::told(0).is_some() { geometry.length([REACH; 3]) } else { 0.0 };
        let farthest = self.options.farthest + beyond;
        advance_front(self.stage, &method, &state, &seeded.bricks, geometry.spacing, farthest)?;
        look_outside(self.stage, self.sources, &method, &state, self.options.farthest)?;
        Ok(self.solved(method, state, &seeded))
    }

    fn sweeps<P: Precision, M: OrderedSweeps + 'a>(&self, method: M, iterations: u32) -> Result<Solved<'a, P>> {
        let (state, seeded) = self.start::<M>(Start::Fixed)?;
        sweep_all(self.stage, &method, &state, &mut Alone(self.set), &seeded.bricks, iterations)?;
        look_outside(self.stage, self.sources, &method, &state, self.options.farthest)?;
        Ok(self.solved(method, state, &seeded))
    }

    /// Distances, and along with them their sources, where these are asked for.
    fn sweeps_with_sources<P: Precision>(
        &self,
        method: FastSweeping<P, f64>,
        iterations: u32,
    ) -> Result<Solved<'a, P>> {
        if !self.options.sources {
            return self.sweeps(method, iterations);
        }
        let (state, sources, seeded) = self.start_apart::<FastSweeping<P, f64>>()?;
        if self.labelled().is_some() {
            // An update that lowers nothing is none, so sweeps do not see that another label is as near.
            sweep_all(self.stage, &method, &state, &mut Alone(self.set), &seeded.bricks, iterations)?;
            self.trace::<P, UpwindSum>(&state, &sources, &seeded)?;
            return Ok(Solved { sources: Arc::new(SourceField(sources)), ..self.solved(method, state, &seeded) });
        }
        let mut tracked = TrackedSweeps::new(self.stage, self.engine.scratch(), &sources, &seeded.bricks)?;
        sweep_all(self.stage, &method, &state, &mut tracked, &seeded.bricks, iterations)?;
        drop(tracked);
        Ok(Solved { sources: Arc::new(SourceField(sources)), ..self.solved(method, state, &seeded) })
    }

    /// Distances, and then their sources, where these are asked for.
    fn front_then_sources<P: Precision, M: DistanceMethod<State = P> + 'a, R: Parents>(
        &self,
        method: M,
    ) -> Result<Solved<'a, P>> {
        if !self.options.sources {
            return self.front(method);
        }
        let (state, sources, seeded) = self.start_apart::<M>()?;
        let geometry = self.sources.geometry;
        advance_front(self.stage, &method, &state, &seeded.bricks, geometry.spacing, self.options.farthest)?;
        self.trace::<P, R>(&state, &sources, &seeded)?;
        Ok(Solved { sources: Arc::new(SourceField(sources)), ..self.solved(method, state, &seeded) })
    }

    /// The data sets, where labels are wanted and these are several.
    fn labelled(&self) -> Option<&'a DataSets> {
        self.sources.labelled().filter(|_| self.options.labels)
    }

    fn trace<P: Precision, R: Parents>(
        &self,
        state: &BrickArray<P>,
        sources: &BrickArray<u32>,
        seeded: &Seeded,
    ) -> Result<()> {
        let (geometry, labelled) = (self.sources.geometry, self.labelled());
        trace_sources::<P, R>(self.stage, geometry, labelled, state, sources, &seeded.bricks)
    }

    fn front_vector<P: Precision, S: TrackedSource + 'a>(&self, sources: S) -> Result<Solved<'a, P>> {
        match self.options.neighbours {
            Neighbours::Faces => self.front(sources),
            Neighbours::All => self.front(AllNeighbours::new(sources)),
        }
    }

    fn front_dijkstra<P: Precision, S: TrackedSource + 'a>(&self, sources: S) -> Result<Solved<'a, P>> {
        self.front(DijkstraPythagoras::new(self.sources.geometry, self.options.neighbours, sources))
    }

    fn heap_dijkstra<P: Precision, S: TrackedSource<Number = f64> + 'a>(&self, method: S) -> Result<Solved<'a, P>> {
        let (state, seeded) = self.start::<S>(Start::Fixed)?;
        heap_dijkstra(self.engine, self.sources.geometry, &method, self.options.neighbours, &state)?;
        look_outside(self.stage, self.sources, &method, &state, self.options.farthest)?;
        Ok(self.solved(method, state, &seeded))
    }

    fn heap_marching<P: Precision, M: DistanceMethod<State = P> + 'a, S: TrackedSource>(
        &self,
        method: M,
        start: &S,
    ) -> Result<Solved<'a, P>> {
        let (sources, seeded) = self.start::<S>(Start::Fixed)?;
        let state = BrickArray::new(self.engine.scratch(), self.set)?;
        let wanted = Wanted { sources: self.options.sources, labelled: self.labelled() };
        heap_marching(self.engine, self.sources.geometry, start, wanted, &state, &sources)?;
        Ok(Solved { sources: Arc::new(SourceField(sources)), ..self.solved(method, state, &seeded) })
    }

    fn solved<P: Precision, M: DistanceMethod + 'a>(
        &self,
        method: M,
        state: BrickArray<M::State>,
        seeded: &Seeded,
    ) -> Solved<'a, P> {
        let values = Values { method, state, farthest: self.options.farthest, buffers: Workers::new(Vec::new) };
        values.solved(seeded.fixed_voxels, seeded.triangle_distances)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_and_thin_grids_get_small_bricks() {
        let of = |name: &str, shape| Method::named(name).unwrap().solver::<f32>().brick_for(shape);
        for shape in [[1; 3], [145; 3], [289; 3], [397; 3], [3000, 3000, 1], [20_000, 30, 20_000], [70, 1300, 1300]] {
            assert_eq!(SOLVERS.iter().map(|row| row.brick_for(shape)).max(), Some(32), "{shape:?}");
        }
        for shape in [[577; 3], [512; 3], [2048, 2048, 1024], [1024, 20_000, 250]] {
            assert_eq!([of("fsm", shape), of("vdt", shape)], [64, 32], "{shape:?}");
        }
    }

    /// Bricks never store much more beyond the grid's border than small ones would.
    #[test]
    fn bricks_stick_out_of_no_grid_far() {
        let stored = |shape, edge| BrickGrid::new(shape, edge).len() * edge.pow(3) as u64;
        for n in 1..400 {
            let shape = [n, 3 * n + 1, 2000 / n + 5];
            for row in SOLVERS {
                let edge = row.brick_for(shape);
                assert!(4 * stored(shape, edge) <= 5 * stored(shape, 32), "{} {shape:?}: {edge}", row.name);
            }
        }
    }
}
