//! What a method leaves, read with a second look at the source of each voxel (`kernel::distance::repair::bends`): at
//! those that the `front` schedule may have lost where sources are tracked, and at equally near ones of lower labels.
//! Nothing more is stored, and no brick is visited for it: whoever reads a box reads two voxels more around it.

use std::ops::Range;
use std::sync::Arc;

use super::field::DistanceWithSource;
use super::within::within;
use crate::error::Result;
use crate::exec::Workers;
use crate::grid::{Box3, Geometry, NO_SOURCE};
use crate::kernel::distance::methods::shape_distance::ShapeDistance;
use crate::kernel::distance::methods::tracked::TrackedSource;
use crate::kernel::distance::methods::vector_distance::VectorDistance;
use crate::kernel::distance::repair::bends::{MARGIN, Repair};
use crate::kernel::distance::repair::repair_box::Labels;
use crate::kernel::distance::repair::repair_box::RepairBox;
use crate::kernel::distance::state::precision::Precision;
use crate::pipeline::distance::{Options, Schedule, Solved, Sources};
use crate::store::BoxSource;

/// Edge of the pieces that a box is looked at in: some 6 MB of buffers for each thread.
const PIECE: i64 = 64;

/// A solved distance as it is read: where its sources are tracked, with a second look at them.
pub(crate) fn looked_over<'a, P: Precision>(
    solved: Solved<'a, P>,
    sources: &Sources<'a>,
    options: Options,
    (is_tracked, schedule): (bool, Schedule),
) -> Solved<'a, P> {
    let solved = if is_tracked { with_repair(solved, sources, options, schedule == Schedule::Front) } else { solved };
    within(solved, options.farthest)
}

/// A solved distance of a method that tracks sources, each voxel looked at again as it is read: for sources that were
/// lost too where a `front` solved it.
fn with_repair<'a, P: Precision>(
    solved: Solved<'a, P>,
    sources: &Sources<'a>,
    options: Options,
    is_front: bool,
) -> Solved<'a, P> {
    let sets = sources.labelled().filter(|_| options.sources);
    let labels = sets.map(|sets| Labels { sets, trees: sources.trees.filter(|_| is_front) });
    let (geometry, positions) = (sources.geometry, sources.positions);
    let kind = Kind { is_front, labels, farthest: options.farthest };
    match (sources.shapes(), is_front || labels.is_some()) {
        (_, false) => solved,
        (Some(shapes), _) => join(solved, geometry, ShapeDistance::new(geometry, shapes), kind),
        (None, _) => join(solved, geometry, VectorDistance::<P::Fast>::new(geometry, positions), kind),
    }
}

/// What is looked for.
#[derive(Clone, Copy)]
struct Kind<'a> {
    /// Whether sources came by a front, which loses some.
    is_front: bool,
    labels: Option<Labels<'a>>,
    farthest: f64,
}

fn join<'a, P: Precision, S: TrackedSource + 'a>(
    solved: Solved<'a, P>,
    geometry: &'a Geometry,
    method: S,
    kind: Kind<'a>,
) -> Solved<'a, P> {
    let buffers = Workers::new(Default::default);
    let repair = Arc::new(Repaired { method, geometry, found: solved.sources, kind, buffers });
    if kind.is_front {
        Solved { values: repair.clone(), with_source: Some(repair.clone()), sources: repair, ..solved }
    } else {
        Solved { sources: repair, ..solved }
    }
}

/// Sources as a method left them, and what tells how far they are.
struct Repaired<'a, S> {
    method: S,
    geometry: &'a Geometry,
    found: Arc<dyn BoxSource<u32> + Send + 'a>,
    kind: Kind<'a>,
    /// Kept from one read to the next: fresh memory would cost more than what is computed in it.
    buffers: Workers<(Vec<u32>, Repair)>,
}

impl<S: TrackedSource> Repaired<'_, S> {
    /// Looks at a box, a piece at a time so that buffers stay small, and hands on what was seen of each.
    fn see(&self, part: &Box3, mut then: impl FnMut(&Box3, &Repair)) -> Result<()> {
        let (geometry, Kind { is_front, labels, farthest }) = (self.geometry, self.kind);
        let lost_within = is_front.then_some(farthest);
        self.buffers.with(|(found, repair)| {
            for piece in pieces(part) {
                let known = piece.grow(MARGIN).intersect(&geometry.domain());
                found.resize(known.len().max(found.len()), NO_SOURCE);
                let found = &mut found[..known.len()];
                self.found.read_box(&known, found)?;
                repair.run(
                    &self.method,
                    &RepairBox { geometry, part: &piece, known: &known, found, lost_within, labels },
                );
                then(&piece, repair);
            }
            Ok(())
        })
    }
}

impl<S> Repaired<'_, S> {
    fn distances<P: Precision>(&self, squared: &[f64], out: &mut [P]) {
        for (out, squared) in out.iter_mut().zip(squared) {
            *out = P::from_f64(squared.sqrt().min(self.kind.farthest));
        }
    }
}

/// Cubes of at most [`PIECE`] voxels an edge that make up a box.
fn pieces(part: &Box3) -> impl Iterator<Item = Box3> {
    let part = *part;
    let counts = part.shape().map(|n| (n + PIECE - 1) / PIECE);
    Box3::from_shape(counts).rows().flat_map(move |(y, z)| {
        (0..counts[0]).map(move |x| {
            let lo = std::array::from_fn(|a| part.lo[a] + PIECE * [x, y, z][a]);
            Box3::new(lo, lo.map(|v| v + PIECE)).intersect(&part)
        })
    })
}

/// Calls `copy` with the rows of a piece: where each lies in the box, and in the piece.
fn each_row(part: &Box3, piece: &Box3, mut copy: impl FnMut(Range<usize>, Range<usize>)) {
    let width = piece.shape()[0] as usize;
    for (n, (y, z)) in piece.rows().enumerate() {
        let at = part.offset_of([piece.lo[0], y, z]);
        copy(at..at + width, n * width..(n + 1) * width);
    }
}

impl<S: TrackedSource> BoxSource<u32> for Repaired<'_, S> {
    fn shape(&self) -> [i64; 3] {
        self.geometry.shape
    }

    fn read_box(&self, part: &Box3, out: &mut [u32]) -> Result<()> {
        self.see(part, |piece, repair| {
            each_row(part, piece, |to, from| out[to].copy_from_slice(&repair.sources[from]));
        })
    }
}

impl<S: TrackedSource, P: Precision> DistanceWithSource<P> for Repaired<'_, S> {
    fn read_both(&self, part: &Box3, values: &mut [P], sources: &mut [u32]) -> Result<()> {
        self.see(part, |piece, repair| {
            each_row(part, piece, |to, from| {
                sources[to.clone()].copy_from_slice(&repair.sources[from.clone()]);
                self.distances(&repair.squared[from], &mut values[to]);
            });
        })
    }
}

impl<S: TrackedSource, P: Precision> BoxSource<P> for Repaired<'_, S> {
    fn shape(&self) -> [i64; 3] {
        self.geometry.shape
    }

    fn read_box(&self, part: &Box3, out: &mut [P]) -> Result<()> {
        self.see(part, |piece, repair| {
            each_row(part, piece, |to, from| self.distances(&repair.squared[from], &mut out[to]));
        })
    }
}
