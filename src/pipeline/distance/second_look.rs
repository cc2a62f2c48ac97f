//! What the `front` schedule leaves of a method that tracks sources, read with a second look at each voxel
//! (`kernel::distance::second_look`). Nothing more is stored, and no brick is visited for it: whoever reads a box reads
//! two voxels more around it.

use std::sync::Arc;

use super::{Options, Solved, Sources};
use crate::error::Result;
use crate::exec::Workers;
use crate::grid::{Box3, Geometry};
use crate::kernel::distance::initialise::NO_SOURCE;
use crate::kernel::distance::precision::Precision;
use crate::kernel::distance::second_look::{Look, MARGIN, Seen};
use crate::kernel::distance::shape_distance::ShapeDistance;
use crate::kernel::distance::tracked::TrackedSource;
use crate::kernel::distance::vector_distance::VectorDistance;
use crate::store::BoxSource;

/// A solved distance, each voxel looked at again as it is read.
pub(super) fn with_second_look<'a, P: Precision>(
    solved: Solved<'a, P>,
    sources: &Sources<'a>,
    options: Options,
) -> Solved<'a, P> {
    let geometry = sources.geometry;
    match sources.sets {
        Some(sets) => join(solved, geometry, ShapeDistance::new(geometry, sets), options),
        None => join(solved, geometry, VectorDistance::<P::Fast>::new(geometry, sources.positions), options),
    }
}

fn join<'a, P: Precision, S: TrackedSource + 'a>(
    solved: Solved<'a, P>,
    geometry: &'a Geometry,
    method: S,
    options: Options,
) -> Solved<'a, P> {
    let buffers = Workers::new(Default::default);
    let seen = Arc::new(SecondLook { method, geometry, found: solved.sources, farthest: options.farthest, buffers });
    Solved { values: seen.clone(), sources: seen, ..solved }
}

/// Sources as a method left them, and what tells how far they are.
struct SecondLook<'a, S> {
    method: S,
    geometry: &'a Geometry,
    found: Arc<dyn BoxSource<u32> + Send + 'a>,
    farthest: f64,
    /// Kept from one read to the next: fresh memory would cost more than what is computed in it.
    buffers: Workers<(Vec<u32>, Seen)>,
}

impl<S: TrackedSource> SecondLook<'_, S> {
    /// Looks at a box and hands on what was seen.
    fn see(&self, part: &Box3, then: impl FnOnce(&Seen)) -> Result<()> {
        let (geometry, farthest) = (self.geometry, self.farthest);
        let known = part.grow(MARGIN).intersect(&geometry.domain());
        self.buffers.with(|(found, seen)| {
            found.resize(known.len().max(found.len()), NO_SOURCE);
            let found = &mut found[..known.len()];
            self.found.read_box(&known, found)?;
            seen.look(&self.method, &Look { geometry, part, known: &known, found, farthest });
            then(seen);
            Ok(())
        })
    }
}

impl<S: TrackedSource> BoxSource<u32> for SecondLook<'_, S> {
    fn shape(&self) -> [i64; 3] {
        self.geometry.shape
    }

    fn read_box(&self, part: &Box3, out: &mut [u32]) -> Result<()> {
        self.see(part, |seen| out.copy_from_slice(&seen.sources))
    }
}

impl<S: TrackedSource, P: Precision> BoxSource<P> for SecondLook<'_, S> {
    fn shape(&self) -> [i64; 3] {
        self.geometry.shape
    }

    fn read_box(&self, part: &Box3, out: &mut [P]) -> Result<()> {
        self.see(part, |seen| {
            for (out, squared) in out.iter_mut().zip(&seen.squared) {
                *out = P::from_f64(squared.sqrt().min(self.farthest));
            }
        })
    }
}
