//! What the methods that track sources share: how far a voxel is from one, in which arithmetic, and which source a
//! state names. A method that carries sources in another order than VDT's is written once for points and for triangles.

use crate::grid::SourceState;
use crate::kernel::distance::state::method::DistanceState;
use crate::kernel::distance::state::precision::Real;

/// Sources, and the exact distances to them.
pub trait TrackedSource: DistanceState<State = SourceState> {
    /// What distances are compared in.
    type Number: Real;

    /// The coordinate of a voxel's centre along an axis, as distances are computed from.
    fn coordinate(&self, axis: usize, index: i64) -> Self::Number;

    /// The squared distance of a place to a source; infinite to none.
    fn squared(&self, here: [Self::Number; 3], source: u32) -> Self::Number;

    /// The squared distance of a voxel to a source, in f64; infinite to none.
    fn squared_of_voxel(&self, source: u32, voxel: [i64; 3]) -> f64;

    /// Whether the first of two sources, each with a voxel's squared distance to it, is to be kept rather than the
    /// second. Of equally near ones that is the second, which was there before; unless their labels differ, and their
    /// numbers do not tell of which label is lower.
    fn is_nearer(&self, (squared, _): (Self::Number, u32), than: (Self::Number, u32)) -> bool {
        squared < than.0
    }

    /// Those of a row of voxels along x, the first at `start`, each to its own source.
    fn squared_row(&self, sources: &[u32], start: [i64; 3], out: &mut [f64]) {
        for ((x, out), &source) in (start[0]..).zip(out).zip(sources) {
            *out = self.squared_of_voxel(source, [x, start[1], start[2]]);
        }
    }
}

/// A method that carries sources from voxel to voxel, in whatever order: a voxel holds which one it has.
pub trait CarriesSources: Send + Sync {
    /// The sources.
    type Sources: TrackedSource;

    /// Those that it carries.
    fn sources(&self) -> &Self::Sources;
}

impl<M: CarriesSources> DistanceState for M {
    type State = SourceState;
    const UNKNOWN: SourceState = SourceState::FAR;

    fn fixed(_: f64, source: u32) -> SourceState {
        SourceState::frozen(source)
    }

    fn trial(source: u32) -> Option<SourceState> {
        Some(SourceState::trial(source))
    }

    fn is_fixed(state: SourceState) -> bool {
        state.is_frozen()
    }

    /// Judged as a sweep judges it, so that nobody is called for nothing.
    fn entering(&self, beside: SourceState, state: SourceState, voxel: [i64; 3]) -> Option<f64> {
        let [beside, kept] = [beside.source(), state.source()];
        if state.is_frozen() || beside == kept {
            return None;
        }
        let sources = self.sources();
        let here = std::array::from_fn(|a| sources.coordinate(a, voxel[a]));
        let entering = sources.squared(here, beside);
        let is_nearer = sources.is_nearer((entering, beside), (sources.squared(here, kept), kept));
        is_nearer.then(|| entering.f64().sqrt())
    }

    fn distance(&self, state: SourceState, voxel: [i64; 3]) -> f64 {
        self.distance_squared(state, voxel).sqrt()
    }

    fn distance_squared(&self, state: SourceState, voxel: [i64; 3]) -> f64 {
        self.sources().squared_of_voxel(state.source(), voxel)
    }

    fn source(state: SourceState) -> Option<u32> {
        state.known()
    }
}
