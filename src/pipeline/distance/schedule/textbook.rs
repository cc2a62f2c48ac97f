//! FMM and DP in the textbook's order: the bricks of a field are gathered into one dense array, one heap marches over
//! it (`kernel::distance::whole_volume`), the bricks get their voxels back. On one thread of one
//! rank.

use crate::error::Result;
use crate::exec::Engine;
use crate::grid::{DataSets, Geometry, SourceState};
use crate::kernel::distance::methods::tracked::TrackedSource;
use crate::kernel::distance::state::neighbours::Neighbours;
use crate::kernel::distance::state::precision::{Precision, Real};
use crate::kernel::distance::whole_volume::dijkstra_heap::DijkstraHeap;
use crate::kernel::distance::whole_volume::marching_heap::MarchingHeap;
use crate::pipeline::distance::medium::{Medium, time_squared};
use crate::store::{BoxSource, BrickArray};

/// Voxels frozen between two looks at whether the run was interrupted.
const STRIDE: usize = 1 << 20;

/// Carries sources from the fixed voxels among `states`.
pub(crate) fn heap_dijkstra<S: TrackedSource<Number = f64>>(
    engine: &Engine,
    geometry: &Geometry,
    method: &S,
    neighbours: Neighbours,
    states: &BrickArray<SourceState>,
) -> Result<()> {
    if states.set().owned().is_empty() {
        return Ok(());
    }
    let domain = geometry.domain();
    let mut dense = vec![SourceState::FAR; domain.len()];
    states.read_box(&domain, &mut dense)?;
    let mut heap = DijkstraHeap::new(geometry, method, neighbours, &mut dense);
    while heap.advance(STRIDE) {
        engine.check()?;
    }
    drop(heap);
    states.write_box(&domain, &dense);
    Ok(())
}

/// What of sources is wanted beside distances.
#[derive(Clone, Copy)]
pub(crate) struct Wanted<'a> {
    pub(crate) sources: bool,
    /// The data sets whose labels they stand for.
    pub(crate) labelled: Option<&'a DataSets>,
    /// Where a front is not equally fast everywhere; sources are not followed there.
    pub(crate) medium: Option<&'a Medium>,
}

/// Marches from the fixed voxels among `states` into `distances`; where sources are `wanted`, `states` get them.
pub(crate) fn heap_marching<P: Precision, S: TrackedSource>(
    engine: &Engine,
    geometry: &Geometry,
    start: &S,
    wanted: Wanted<'_>,
    distances: &BrickArray<P>,
    states: &BrickArray<SourceState>,
) -> Result<()> {
    if states.set().owned().is_empty() {
        return Ok(());
    }
    let domain = geometry.domain();
    let mut dense = vec![SourceState::FAR; domain.len()];
    states.read_box(&domain, &mut dense)?;
    let mut values = vec![P::UNKNOWN; domain.len()];
    let speeds = wanted.medium.map(Medium::whole).transpose()?;
    for (place, (y, z)) in (0..).step_by(domain.shape()[0] as usize).zip(domain.rows()) {
        for x in domain.lo[0]..domain.hi[0] {
            let place = place + x as usize;
            let state = dense[place];
            if S::is_fixed(state) {
                let squared = start.distance_squared(state, [x, y, z]);
                let squared = speeds.as_ref().map_or(squared, |speeds| time_squared(squared, speeds[place]));
                values[place] = P::of_lane(P::round(squared.sqrt()).marked());
            }
        }
    }
    let sources = wanted.sources.then_some(dense.as_mut_slice());
    let mut heap = MarchingHeap::new(geometry, &mut values, sources, wanted.labelled).through(speeds.as_deref());
    while heap.advance(STRIDE) {
        engine.check()?;
    }
    drop(heap);
    if wanted.sources {
        states.write_box(&domain, &dense);
    }
    distances.write_box(&domain, &values);
    Ok(())
}
