//! Draws surfaces between labels box by box, on all threads and ranks, welded in grid order, and measures them.

use std::ops::Range;

use super::assembled::{Found, MadePatch, Takes, Whole, send};
use crate::error::Result;
use crate::exec::{Comm, Stage, Workers};
use crate::grid::{Box3, BrickGrid, BrickId, Geometry};
use crate::kernel::surface::{Bending, TaggedPatch};
use crate::pipeline::output::drawn::{Drawn, Wave};
use crate::store::{MeshSink, Spill};

/// Edge of the boxes that the surface is drawn in, whatever the bricks are: so these do not tell the order of vertices.
pub(super) const EDGE: i64 = 32;

/// What draws the surface in one box.
pub(super) trait Draws: Sync {
    /// Work buffers.
    type Work: Send + 'static;

    /// Where it lies.
    fn geometry(&self) -> &Geometry;

    /// Who makes the buffers of a thread.
    fn work(&self) -> Box<dyn Fn() -> Self::Work + Send + Sync>;

    /// Bytes of them.
    fn work_bytes(work: &Self::Work) -> u64;

    /// The surface in a box.
    fn patch(&self, work: &mut Self::Work, part: &Box3) -> Result<TaggedPatch>;

    /// How wide the gap is at each vertex.
    fn gaps(&self, patch: &TaggedPatch) -> Vec<f64>;
}

/// The boxes that the surface is drawn in, and which of them this rank draws: a run of them, so that in order of ranks they are in
/// grid order.
pub(super) struct Boxes {
    grid: BrickGrid,
    own: Range<BrickId>,
}

impl Boxes {
    /// Of one of the ranks of `comm`.
    pub(super) fn new(geometry: &Geometry, comm: &dyn Comm) -> Self {
        let grid = BrickGrid::new(geometry.shape, EDGE);
        let cut = |rank: usize| grid.len() * rank as u64 / comm.ranks() as u64;
        Self { grid, own: cut(comm.rank())..cut(comm.rank() + 1) }
    }

    /// What drawing this rank's boxes reads, which is so far around each.
    pub(super) fn reads(&self, reach: [i64; 3]) -> impl Iterator<Item = Box3> {
        let domain = Box3::from_shape(self.grid.shape());
        self.own.clone().map(move |id| {
            let part = self.grid.brick_box(id);
            let (lo, hi) = (0..3).fold((part.lo, part.hi), |(mut lo, mut hi), a| {
                (lo[a], hi[a]) = (lo[a] - reach[a], hi[a] + reach[a]);
                (lo, hi)
            });
            Box3::new(lo, hi).intersect(&domain)
        })
    }
}

/// Sends the surfaces between labels to `sink`, where so many bytes were stated for that; measures all of them, and each
/// pair. Of several ranks each draws its boxes, and the first puts the patches of all together, in their order: it alone has
/// something to send and to tell.
pub(super) fn draw<D: Draws>(
    stage: &Stage<'_>,
    draws: &D,
    boxes: &Boxes,
    stated: u64,
    sink: &mut dyn MeshSink,
) -> Result<Found> {
    let comm = stage.comm();
    let mut whole = Whole::new(draws.geometry(), sink);
    if comm.rank() == 0 {
        draw_own(stage, draws, boxes, stated, &mut whole)?;
        for rank in 1..comm.ranks() {
            whole.take_from(comm, rank)?;
        }
    } else {
        let mut spill = Spill::new(stage.scratch().dir())?;
        draw_own(stage, draws, boxes, stated, &mut spill)?;
        send(comm, spill.read_back()?)?;
    }
    Ok(whole.finish())
}

/// Draws this rank's boxes.
fn draw_own<D: Draws>(stage: &Stage<'_>, draws: &D, boxes: &Boxes, stated: u64, to: &mut dyn Takes) -> Result<()> {
    let spacing = draws.geometry().spacing;
    let (workers, with_gaps) = (Workers::new(draws.work()), to.wants_gaps());
    let bricks: Vec<BrickId> = boxes.own.clone().collect();
    let (mut drawn, mut left) = (Drawn::new(stage, stated), bricks.as_slice());
    while !left.is_empty() {
        let batch;
        (batch, left) = left.split_at(drawn.next().min(left.len()));
        let patches = stage.run(batch, &workers, |work, &id| {
            let patch = draws.patch(work, &boxes.grid.brick_box(id))?;
            let gaps = if with_gaps { draws.gaps(&patch) } else { Vec::new() };
            let bending = Bending::of(&patch.patch, spacing);
            Ok((patch, gaps, bending))
        })?;
        patches.iter().filter(|(patch, ..)| !patch.patch.triangles.is_empty()).try_for_each(|patch| to.take(patch))?;
        let (last, tables) = to.holds();
        let bytes = |(patch, gaps, bending): &MadePatch| patch.bytes() + 8 * gaps.len() as u64 + bending.bytes();
        drawn.took(&Wave {
            patches: &patches.iter().map(bytes).collect::<Vec<_>>(),
            buffers: &workers.idle(D::work_bytes),
            last,
            tables: &tables,
            left: left.len(),
        })?;
    }
    Ok(())
}
