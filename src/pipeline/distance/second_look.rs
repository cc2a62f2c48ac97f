//! What the `front` schedule leaves of a method that tracks sources, read with a second look at each voxel
//! (`kernel::distance::second_look`). Nothing more is stored, and no brick is visited for it: whoever reads a box reads
//! two voxels more around it.

use std::sync::Arc;

use super::{Options, Solved, Sources};
use crate::error::Result;
use crate::grid::{Box3, Geometry};
use crate::kernel::distance::initialise::NO_SOURCE;
use crate::kernel::distance::precision::Precision;
use crate::kernel::distance::second_look::{MARGIN, look_again};
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
    let seen = Arc::new(SecondLook { method, geometry, found: solved.sources, farthest: options.farthest });
    Solved { values: seen.clone(), sources: seen, ..solved }
}

/// Sources as a method left them, and what tells how far they are.
struct SecondLook<'a, S> {
    method: S,
    geometry: &'a Geometry,
    found: Arc<dyn BoxSource<u32> + Send + 'a>,
    farthest: f64,
}

impl<S: TrackedSource> BoxSource<u32> for SecondLook<'_, S> {
    fn shape(&self) -> [i64; 3] {
        self.geometry.shape
    }

    fn read_box(&self, part: &Box3, out: &mut [u32]) -> Result<()> {
        let known = part.grow(MARGIN).intersect(&self.geometry.domain());
        let mut found = vec![NO_SOURCE; known.len()];
        self.found.read_box(&known, &mut found)?;
        look_again(&self.method, self.geometry, &known, &found, part, out);
        Ok(())
    }
}

impl<S: TrackedSource, P: Precision> BoxSource<P> for SecondLook<'_, S> {
    fn shape(&self) -> [i64; 3] {
        self.geometry.shape
    }

    fn read_box(&self, part: &Box3, out: &mut [P]) -> Result<()> {
        let mut sources = vec![NO_SOURCE; part.len()];
        self.read_box(part, &mut sources)?;
        let width = part.shape()[0] as usize;
        for ((y, z), (out, sources)) in part.rows().zip(out.chunks_mut(width).zip(sources.chunks(width))) {
            for ((x, out), &source) in (part.lo[0]..).zip(out).zip(sources) {
                *out = P::from_f64(self.method.distance(source, [x, y, z]).min(self.farthest));
            }
        }
        Ok(())
    }
}
