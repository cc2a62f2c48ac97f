//! A distance solved by the ranks of a run, each on its own bricks, and read as one field: whoever reads a brick reads
//! it from the rank that owns it.

use std::sync::Arc;

use super::readout::early::Early;
use super::readout::repair::looked_over;
use super::solving::Solving;
use super::{Method, Options, Schedule, Solved, Sources, Textbook};
use crate::error::{Error, Result};
use crate::exec::{HaloPlan, Ownership, Reach, Stage, read_by_bricks};
use crate::grid::{Box3, BrickGrid, BrickId, BrickSet};
use crate::kernel::distance::state::precision::Precision;
use crate::store::{BoxSource, Element};

/// Computes the distance to `sources` on the bricks of `set`, by a schedule; on all ranks of the stage's engine, of
/// which the first alone keeps the one heap of a method that has one. Distances and sources do not depend on how many
/// these are.
///
/// # Errors
/// When scratch runs out, the run is interrupted, or a rank ends early.
pub fn solve<'a, P: Precision>(
    stage: &Stage<'_>,
    sources: &Sources<'a>,
    set: &BrickSet,
    method: Method,
    schedule: Schedule,
    options: Options,
) -> Result<Solved<'a, P>> {
    solve_watched(stage, sources, set, (method, schedule), options, Reads::default())
}

/// The same; a front on one rank is read out as far as it has passed.
///
/// # Errors
/// As [`solve`], and when the output cannot be written.
pub fn solve_watched<'a, P: Precision>(
    stage: &Stage<'_>,
    sources: &Sources<'a>,
    set: &BrickSet,
    (method, schedule): (Method, Schedule),
    options: Options,
    reads: Reads<'_, P>,
) -> Result<Solved<'a, P>> {
    let solved = solve_once(stage, sources, set, (method, schedule), options, reads)?;
    Ok(looked_over(solved, sources, options, (method.solver::<P>().tracks_sources(), schedule)))
}

/// The same without a second look at voxels whose nearest source the front may have lost (they are few, away from the
/// sources, and off by less than a spacing), or whose source is as near as one of a lower label.
pub(super) fn solve_once<'a, P: Precision>(
    stage: &Stage<'_>,
    sources: &Sources<'a>,
    set: &BrickSet,
    (method, schedule): (Method, Schedule),
    options: Options,
    reads: Reads<'_, P>,
) -> Result<Solved<'a, P>> {
    // Those that share a process, or are processes of their own.
    let ranks = stage.ranks().max(stage.comm().ranks());
    // Others' bricks are read when all ranks are done.
    let early = reads.early.filter(|_| ranks == 1);
    let solver = method.solver::<P>();
    let one_heap = schedule != Schedule::Front && solver.textbook != Textbook::Sweeps;
    let ownership = if one_heap { Ownership::first(set, ranks) } else { Ownership::balanced(set, ranks) };
    // Sources are found by all 26 neighbours even where distances are not.
    let plan = HaloPlan::new(*set.grid(), Reach::All);
    let mut parts = stage.on_ranks(|stage, engine| {
        let rank = engine.comm().rank();
        let own = Arc::new(ownership.part(set, rank, &plan));
        let borrows = reads.of_others(set.grid(), |id| ownership.owner(id) == rank);
        (solver.solve)(&Solving { stage, engine, sources, set: &own, options, early, borrows: &borrows }, schedule)
    })?;
    if stage.comm().ranks() > 1 {
        // What this rank reads is its own part and what it has borrowed.
        return parts.pop().ok_or_else(|| Error::failed("a rank has solved nothing"));
    }
    let joined = Cut { grid: *set.grid(), ownership };
    let sum = |of: fn(&Solved<'a, P>) -> u64| parts.iter().map(of).sum();
    Ok(Solved {
        values: joined.join(parts.iter().map(|part| part.values.clone()).collect()),
        sources: joined.join(parts.iter().map(|part| part.sources.clone()).collect()),
        with_source: None,
        fixed: joined.join(parts.iter().map(|part| part.fixed.clone()).collect()),
        // Those of several are not put by.
        state: if let [part] = parts.as_slice() { part.state.clone() } else { None },
        fixed_voxels: sum(|part| part.fixed_voxels),
        triangle_distances: sum(|part| part.triangle_distances),
    })
}

/// What is read of a solved distance by the rank that asks for it.
#[derive(Clone, Copy)]
pub struct Reads<'r, P> {
    /// Who reads bricks while others are still solved.
    pub early: Option<&'r dyn Early<P>>,
    /// The boxes that this rank of several reads when all is solved; what it owns, it reads anyway.
    pub boxes: &'r [Box3],
}

impl<P> Default for Reads<'_, P> {
    fn default() -> Self {
        Self { early: None, boxes: &[] }
    }
}

impl<P> Reads<'_, P> {
    /// The bricks of the boxes that are not this rank's own, in order.
    fn of_others(&self, grid: &BrickGrid, is_own: impl Fn(BrickId) -> bool) -> Vec<BrickId> {
        let mut bricks: Vec<BrickId> = self.boxes.iter().flat_map(|part| grid.bricks_in(part)).collect();
        bricks.sort_unstable();
        bricks.dedup();
        bricks.retain(|&id| !is_own(id));
        bricks
    }
}

/// How a field is cut.
#[derive(Clone)]
struct Cut {
    grid: BrickGrid,
    ownership: Ownership,
}

impl Cut {
    fn join<'a, T: Element>(&self, parts: Vec<Part<'a, T>>) -> Part<'a, T> {
        Arc::new(Joined { cut: self.clone(), parts })
    }
}

/// What one rank has of a field.
type Part<'a, T> = Arc<dyn BoxSource<T> + Send + 'a>;

/// A field of which each rank has its own bricks.
struct Joined<'a, T> {
    cut: Cut,
    parts: Vec<Part<'a, T>>,
}

impl<T: Element> BoxSource<T> for Joined<'_, T> {
    fn shape(&self) -> [i64; 3] {
        self.cut.grid.shape()
    }

    fn read_box(&self, part: &Box3, out: &mut [T]) -> Result<()> {
        let Cut { grid, ownership } = &self.cut;
        let mut owners = grid.bricks_in(part).map(|id| ownership.owner(id));
        let first = owners.next().unwrap_or(0);
        if owners.all(|owner| owner == first) {
            return self.parts[first].read_box(part, out);
        }
        read_by_bricks(grid, part, out, |id, shared, values| self.parts[ownership.owner(id)].read_box(shared, values))
    }
}
