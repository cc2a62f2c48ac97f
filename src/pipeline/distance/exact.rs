//! Exact distances: nothing is solved, each voxel asks the sources that can be nearest as it is read
//! (`kernel::distance::features::exact_sources`). No voxel depends on another, so no layout changes a bit, and there are no
//! temporary fields.

use std::sync::Arc;

use super::DistanceSettings;
use super::readout::field::{DistanceWithSource, Solved};
use crate::error::Result;
use crate::exec::Workers;
use crate::grid::{Box3, DataSets, Geometry, NO_SOURCE};
use crate::kernel::distance::features::exact_sources::{ExactSources, Work};
use crate::kernel::distance::features::labelled_shapes::LabelledShapes;
use crate::kernel::distance::features::source_trees::SourceTrees;
use crate::kernel::distance::state::precision::Precision;
use crate::store::BoxSource;

/// Edges of the boxes that voxels are told in: sources around a larger one are too many.
const EDGE: i64 = 32;

/// Distances and sources of any box.
struct Exact<'a> {
    geometry: &'a Geometry,
    shapes: LabelledShapes<'a>,
    trees: SourceTrees,
    farthest: f64,
    workers: Workers<Told>,
}

/// What a thread has told last: it is mostly read once more, as something else.
#[derive(Default)]
struct Told {
    part: Option<Box3>,
    distances: Vec<f64>,
    sources: Vec<u32>,
    work: Work,
}

/// The distance to all sources, told as it is read.
pub(super) fn exact<'a, P: Precision>(
    geometry: &'a Geometry,
    sets: &'a DataSets,
    settings: &DistanceSettings,
) -> Solved<'a, P> {
    let (shapes, trees) = (LabelledShapes::new(sets), SourceTrees::new(sets));
    let farthest = settings.farthest.unwrap_or(f64::INFINITY);
    let exact = Arc::new(Exact { geometry, shapes, trees, farthest, workers: Workers::new(Told::default) });
    Solved {
        values: exact.clone(),
        sources: exact.clone(),
        with_source: Some(exact.clone()),
        fixed: exact,
        state: None,
        fixed_voxels: 0,
        triangle_distances: 0,
    }
}

impl Exact<'_> {
    /// Hands on what there is of a box.
    fn with<R>(&self, part: &Box3, read: impl FnOnce(&Told) -> R) -> R {
        self.workers.with(|told| {
            if told.part != Some(*part) {
                self.tell(part, told);
            }
            read(told)
        })
    }

    fn tell(&self, part: &Box3, told: &mut Told) {
        let Told { distances, sources, work, .. } = told;
        distances.clear();
        distances.resize(part.len(), self.farthest);
        sources.clear();
        sources.resize(part.len(), NO_SOURCE);
        let Self { geometry, shapes, trees, farthest, .. } = self;
        let exact = ExactSources { geometry, shapes, trees, farthest: *farthest };
        for tile in part.tiles([EDGE; 3]) {
            let shape = tile.shape();
            exact.nearest(&tile, work, &mut |at, source, squared| {
                let at = at as i64;
                let within = [at % shape[0], at / shape[0] % shape[1], at / (shape[0] * shape[1])];
                let place = part.offset_of(std::array::from_fn(|a| tile.lo[a] + within[a]));
                let distance = squared.sqrt();
                // As of solved ones: what is at the limit is beyond it.
                if distance < self.farthest {
                    (distances[place], sources[place]) = (distance, source);
                }
            });
        }
        told.part = Some(*part);
    }
}

impl<P: Precision> BoxSource<P> for Exact<'_> {
    fn shape(&self) -> [i64; 3] {
        self.geometry.shape
    }

    fn read_box(&self, part: &Box3, out: &mut [P]) -> Result<()> {
        self.with(part, |told| out.iter_mut().zip(&told.distances).for_each(|(out, d)| *out = P::from_f64(*d)));
        Ok(())
    }
}

impl BoxSource<u32> for Exact<'_> {
    fn shape(&self) -> [i64; 3] {
        self.geometry.shape
    }

    fn read_box(&self, part: &Box3, out: &mut [u32]) -> Result<()> {
        self.with(part, |told| out.copy_from_slice(&told.sources));
        Ok(())
    }
}

impl BoxSource<u8> for Exact<'_> {
    fn shape(&self) -> [i64; 3] {
        self.geometry.shape
    }

    /// 1 where a surface may pass between the voxel and one beside it: of two on different sides one is half an edge away at most.
    fn read_box(&self, part: &Box3, out: &mut [u8]) -> Result<()> {
        let near = 0.5 * (1.0 + 1e-9) * self.geometry.spacing.into_iter().fold(0.0, f64::max);
        self.with(part, |told| out.iter_mut().zip(&told.distances).for_each(|(out, d)| *out = u8::from(*d <= near)));
        Ok(())
    }
}

impl<P: Precision> DistanceWithSource<P> for Exact<'_> {
    fn read_both(&self, part: &Box3, values: &mut [P], sources: &mut [u32]) -> Result<()> {
        self.with(part, |told| {
            values.iter_mut().zip(&told.distances).for_each(|(out, d)| *out = P::from_f64(*d));
            sources.copy_from_slice(&told.sources);
        });
        Ok(())
    }
}
