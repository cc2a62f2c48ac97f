//! What the methods that track sources share: how far a voxel is from one, in which arithmetic, and which source a
//! state names. A method that carries sources in another order than VDT's is written once for points and for triangles.

use crate::grid::SourceState;
use crate::kernel::distance::state::method::DistanceMethod;
use crate::kernel::distance::state::precision::Real;

/// Sources, and the exact distances to them.
pub trait TrackedSource: DistanceMethod<State = SourceState> {
    /// What distances are compared in.
    type Number: Real;

    /// The coordinate of a voxel's centre along an axis, as distances are computed from.
    fn coordinate(&self, axis: usize, index: i64) -> Self::Number;

    /// The squared distance of a place to a source; infinite to none.
    fn squared(&self, here: [Self::Number; 3], source: u32) -> Self::Number;

    /// Whether the first of two sources, each with a voxel's squared distance to it, is to be kept rather than the
    /// second. Of equally near ones that is the second, which was there before; unless their labels differ, and their
    /// numbers do not tell of which label is lower.
    fn is_nearer(&self, (squared, _): (Self::Number, u32), than: (Self::Number, u32)) -> bool {
        squared < than.0
    }

    /// Those of a row of voxels along x, the first at `start`, each to its own source.
    fn squared_row(&self, sources: &[u32], start: [i64; 3], out: &mut [f64]) {
        for ((x, out), &source) in (start[0]..).zip(out).zip(sources) {
            *out = self.distance_squared(SourceState::trial(source), [x, start[1], start[2]]);
        }
    }
}
