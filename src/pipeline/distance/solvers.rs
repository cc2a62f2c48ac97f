//! The table of distance methods. A method is one file in `kernel::distance` and one row here; the command line, its
//! help and the shared tests pick it up from the table.

use std::sync::Arc;

use super::field::{Solved, Values};
use super::front::advance_front;
use super::initialise::initialise;
use super::sweep::sweep_all;
use super::{Schedule, Sources};
use crate::error::Result;
use crate::exec::{Engine, Stage};
use crate::grid::BrickSet;
use crate::kernel::distance::dijkstra_pythagoras::DijkstraPythagoras;
use crate::kernel::distance::fast_marching::FastMarching;
use crate::kernel::distance::fast_sweeping::FastSweeping;
use crate::kernel::distance::method::{DistanceMethod, OrderedSweeps};
use crate::kernel::distance::precision::Precision;
use crate::kernel::distance::shape_distance::ShapeDistance;
use crate::kernel::distance::vector_distance::VectorDistance;
use crate::store::BrickArray;

/// Solves on the bricks of a set, by a schedule, as far as a distance.
pub(super) type Solve<P> =
    for<'a> fn(&Stage<'_>, &Engine, &Sources<'a>, &Arc<BrickSet>, Schedule, f64) -> Result<Solved<'a, P>>;

/// One row of the table, for fields stored as `P`.
#[derive(Clone, Copy, Debug)]
pub struct Solver<P> {
    /// What `--method` calls it.
    pub name: &'static str,
    /// One line for the help.
    pub about: &'static str,
    /// Whether it can be done by ordered sweeps.
    pub sweeps: bool,
    /// Whether it keeps the source of each voxel.
    pub keeps_sources: bool,
    /// Edge of bricks that it is fastest with.
    pub brick: i64,
    /// Bytes of a voxel's state.
    pub state_bytes: u64,
    /// Does it.
    pub solve: Solve<P>,
}

/// The distance methods, in the order in which the help lists them.
#[must_use]
pub const fn solvers<P: Precision>() -> [Solver<P>; 4] {
    [
        Solver {
            name: "fsm",
            about: "fast sweeping, the Eikonal equation",
            sweeps: true,
            keeps_sources: false,
            brick: 32,
            state_bytes: size_of::<P>() as u64,
            solve: fast_sweeping::<P>,
        },
        Solver {
            name: "vdt",
            about: "vector distance transform, Euclidean to a tracked source",
            sweeps: true,
            keeps_sources: true,
            brick: 32,
            state_bytes: 4,
            solve: vector_distance::<P>,
        },
        Solver {
            name: "fmm",
            about: "fast marching, the Eikonal equation",
            sweeps: false,
            keeps_sources: false,
            brick: 32,
            state_bytes: size_of::<P>() as u64,
            solve: fast_marching::<P>,
        },
        Solver {
            name: "dp",
            about: "Dijkstra-Pythagoras, Euclidean to a tracked source",
            sweeps: false,
            keeps_sources: true,
            brick: 32,
            state_bytes: 4,
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
    farthest: f64,
) -> Result<Solved<'a, P>> {
    let job = Job { stage, engine, sources, set, farthest };
    let spacing = sources.geometry.spacing;
    match schedule {
        Schedule::Front => job.front(FastSweeping::<P, P::Fast>::new(spacing)),
        Schedule::Sweep { iterations } => job.sweeps(FastSweeping::<P, f64>::new(spacing), iterations),
    }
}

fn fast_marching<'a, P: Precision>(
    stage: &Stage<'_>,
    engine: &Engine,
    sources: &Sources<'a>,
    set: &Arc<BrickSet>,
    _: Schedule,
    farthest: f64,
) -> Result<Solved<'a, P>> {
    let job = Job { stage, engine, sources, set, farthest };
    job.front(FastMarching::<P, P::Fast>::new(sources.geometry.spacing))
}

fn vector_distance<'a, P: Precision>(
    stage: &Stage<'_>,
    engine: &Engine,
    sources: &Sources<'a>,
    set: &Arc<BrickSet>,
    schedule: Schedule,
    farthest: f64,
) -> Result<Solved<'a, P>> {
    let job = Job { stage, engine, sources, set, farthest };
    let (geometry, positions) = (sources.geometry, sources.positions);
    if let Some(sets) = sources.sets {
        let method = ShapeDistance::new(geometry, sets);
        return match schedule {
            Schedule::Front => job.front(method),
            Schedule::Sweep { iterations } => job.sweeps(method, iterations),
        };
    }
    match schedule {
        Schedule::Front => job.front(VectorDistance::<P::Fast>::new(geometry, positions)),
        Schedule::Sweep { iterations } => job.sweeps(VectorDistance::<f64>::new(geometry, positions), iterations),
    }
}

fn dijkstra_pythagoras<'a, P: Precision>(
    stage: &Stage<'_>,
    engine: &Engine,
    sources: &Sources<'a>,
    set: &Arc<BrickSet>,
    _: Schedule,
    farthest: f64,
) -> Result<Solved<'a, P>> {
    let job = Job { stage, engine, sources, set, farthest };
    let geometry = sources.geometry;
    if let Some(sets) = sources.sets {
        return job.front(DijkstraPythagoras::new(geometry, ShapeDistance::new(geometry, sets)));
    }
    job.front(DijkstraPythagoras::new(geometry, VectorDistance::<P::Fast>::new(geometry, sources.positions)))
}

/// What every method is given.
struct Job<'j, 'a> {
    stage: &'j Stage<'j>,
    engine: &'j Engine,
    sources: &'j Sources<'a>,
    set: &'j Arc<BrickSet>,
    farthest: f64,
}

impl<'a> Job<'_, 'a> {
    fn front<P: Precision, M: DistanceMethod + 'a>(&self, method: M) -> Result<Solved<'a, P>> {
        let state = BrickArray::blank(self.engine.scratch(), self.set, M::UNKNOWN)?;
        let (start, fixed) = initialise::<M>(self.stage, self.sources, &state)?;
        advance_front(self.stage, &method, &state, &start, self.sources.geometry.spacing, self.farthest)?;
        Ok(self.solved(method, state, fixed))
    }

    fn sweeps<P: Precision, M: OrderedSweeps + 'a>(&self, method: M, iterations: u32) -> Result<Solved<'a, P>> {
        let state = BrickArray::blank(self.engine.scratch(), self.set, M::UNKNOWN)?;
        let (start, fixed) = initialise::<M>(self.stage, self.sources, &state)?;
        sweep_all(self.stage, &method, &state, &start, iterations)?;
        Ok(self.solved(method, state, fixed))
    }

    fn solved<P: Precision, M: DistanceMethod + 'a>(
        &self,
        method: M,
        state: BrickArray<M::State>,
        fixed_voxels: u64,
    ) -> Solved<'a, P> {
        let values = Arc::new(Values { method, state, farthest: self.farthest });
        Solved { sources: values.clone(), fixed: values.clone(), values, fixed_voxels }
    }
}
