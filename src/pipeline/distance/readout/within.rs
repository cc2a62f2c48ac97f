//! Sources of voxels that a limited distance reached: beyond the limit a brick that was visited knows some, and its neighbour that
//! was not knows none, so that what labels are there would tell where bricks lie.

use std::sync::Arc;

use super::field::{DistanceWithSource, Solved};
use crate::error::Result;
use crate::exec::Workers;
use crate::grid::{Box3, NO_SOURCE};
use crate::kernel::distance::state::precision::Precision;
use crate::store::BoxSource;

/// A solved distance whose voxels at the limit or beyond have no source.
pub(crate) fn within<P: Precision>(solved: Solved<'_, P>, farthest: f64) -> Solved<'_, P> {
    if !farthest.is_finite() {
        return solved;
    }
    let Solved { values, sources, with_source, .. } = &solved;
    let all = Within {
        values: values.clone(),
        sources: sources.clone(),
        with_source: with_source.clone(),
        limit: P::from_f64(farthest),
        buffers: Workers::new(Vec::new),
    };
    let all = Arc::new(all);
    Solved { sources: all.clone(), with_source: Some(all), ..solved }
}

struct Within<'a, P> {
    values: Arc<dyn BoxSource<P> + Send + 'a>,
    sources: Arc<dyn BoxSource<u32> + Send + 'a>,
    with_source: Option<Arc<dyn DistanceWithSource<P> + Send + 'a>>,
    limit: P,
    /// Kept from one read to the next.
    buffers: Workers<Vec<P>>,
}

impl<P: Precision> DistanceWithSource<P> for Within<'_, P> {
    fn read_both(&self, part: &Box3, values: &mut [P], sources: &mut [u32]) -> Result<()> {
        if let Some(both) = &self.with_source {
            both.read_both(part, values, sources)?;
        } else {
            self.values.read_box(part, values)?;
            self.sources.read_box(part, sources)?;
        }
        let beyond = values.iter().zip(sources).filter(|(value, _)| **value >= self.limit);
        beyond.for_each(|(_, source)| *source = NO_SOURCE);
        Ok(())
    }
}

impl<P: Precision> BoxSource<u32> for Within<'_, P> {
    fn shape(&self) -> [i64; 3] {
        self.sources.shape()
    }

    fn read_box(&self, part: &Box3, out: &mut [u32]) -> Result<()> {
        self.buffers.with(|values| {
            values.resize(part.len().max(values.len()), self.limit);
            self.read_both(part, &mut values[..part.len()], out)
        })
    }
}
