//! A distance solved by the ranks of a run, each on its own bricks; of those of others each gets what it reads.

use std::sync::Arc;

use super::readout::early::Early;
use super::readout::repair::looked_over;
use super::solving::Solving;
use super::{Method, Options, Schedule, Solved, Sources, Textbook};
use crate::error::Result;
use crate::exec::{Comm, HaloPlan, Ownership, Reach, Stage};
use crate::grid::{Box3, BrickGrid, BrickId, BrickSet};
use crate::kernel::distance::state::precision::Precision;

/// Computes the distance to `sources` on this rank's part of the bricks of `set`, by a schedule; of the ranks of the stage's engine the
/// first alone keeps the one heap of a method that has one. Distances and sources do not depend on how many these are.
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
    let (comm, engine) = (stage.comm(), stage.engine());
    // Others' bricks are read when all ranks are done.
    let early = reads.early.filter(|_| comm.ranks() == 1);
    let solver = method.solver::<P>();
    let (ownership, own) = part_of_rank::<P>(comm, set, (method, schedule));
    let borrows = reads.of_others(set.grid(), |id| ownership.owner(id) == comm.rank());
    // What this rank reads is its own part and what it has borrowed.
    (solver.solve)(&Solving { stage, engine, sources, set: &own, options, early, borrows: &borrows }, schedule)
}

/// Who owns which bricks of a set, and the part of this rank.
pub(super) fn part_of_rank<P: Precision>(
    comm: &dyn Comm,
    set: &BrickSet,
    (method, schedule): (Method, Schedule),
) -> (Ownership, Arc<BrickSet>) {
    let one_heap = schedule != Schedule::Front && method.solver::<P>().textbook != Textbook::Sweeps;
    let ownership = if one_heap { Ownership::first(set, comm.ranks()) } else { Ownership::balanced(set, comm.ranks()) };
    // Sources are found by all 26 neighbours even where distances are not.
    let plan = HaloPlan::new(*set.grid(), Reach::All);
    let own = Arc::new(ownership.part(set, comm.rank(), &plan));
    (ownership, own)
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
