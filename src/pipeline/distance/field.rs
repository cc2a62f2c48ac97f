//! What a solved distance can be read as: distances and the indices of nearest sources, both made out of the state of
//! the method as they are read, so that no second field is stored.

use std::sync::Arc;

use crate::error::Result;
use crate::exec::{Stage, Workers, one_wave};
use crate::grid::{Box3, BrickSet};
use crate::kernel::distance::initialise::NO_SOURCE;
use crate::kernel::distance::method::DistanceMethod;
use crate::kernel::distance::precision::Precision;
use crate::store::{BoxSource, BrickArray};

/// A solved distance.
pub struct Solved<'a, P> {
    /// Distances in physical units, none above the farthest asked for; infinite where no source is known.
    pub values: Arc<dyn BoxSource<P> + Send + 'a>,
    /// For each voxel the index of its nearest known source, or [`NO_SOURCE`].
    pub sources: Arc<dyn BoxSource<u32> + Send + 'a>,
    /// Voxels that sources fixed.
    pub fixed_voxels: u64,
}

/// What a field holds, for the report.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measured {
    /// The largest finite distance.
    pub max: f64,
    /// Voxels that no source reached.
    pub unlabelled_voxels: u64,
}

impl<P: Precision> Solved<'_, P> {
    /// Looks at every voxel.
    ///
    /// # Errors
    /// When the run is interrupted.
    pub fn measure(&self, stage: &Stage<'_>, set: &BrickSet) -> Result<Measured> {
        let len = set.grid().brick_len();
        let workers = Workers::new(move || vec![P::default(); len]);
        let parts = stage.run(&one_wave(set), &workers, |values, &slot| {
            let part = set.grid().brick_box(set.id(slot));
            let values = &mut values[..part.len()];
            self.values.read_box(&part, values)?;
            let known = |v: &f64| v.is_finite();
            let max = values.iter().map(|v| v.to_f64()).filter(known).fold(0.0, f64::max);
            let unknown = values.iter().filter(|v| !v.to_f64().is_finite()).count();
            Ok(Measured { max, unlabelled_voxels: unknown as u64 })
        })?;
        Ok(parts.iter().fold(Measured::default(), |all, part| Measured {
            max: all.max.max(part.max),
            unlabelled_voxels: all.unlabelled_voxels + part.unlabelled_voxels,
        }))
    }
}

/// A method's state, read as distances or sources.
pub(super) struct Values<M: DistanceMethod> {
    pub(super) method: M,
    pub(super) state: BrickArray<M::State>,
    pub(super) farthest: f64,
}

impl<M: DistanceMethod> Values<M> {
    /// Reads the state of a box and hands each voxel on, with its place in the box.
    fn each(&self, part: &Box3, mut f: impl FnMut(usize, M::State, [i64; 3])) -> Result<()> {
        let mut states = vec![M::UNKNOWN; part.len()];
        self.state.read_box(part, &mut states)?;
        let mut at = 0;
        for (y, z) in part.rows() {
            for x in part.lo[0]..part.hi[0] {
                f(at, states[at], [x, y, z]);
                at += 1;
            }
        }
        Ok(())
    }
}

impl<M: DistanceMethod, P: Precision> BoxSource<P> for Values<M> {
    fn shape(&self) -> [i64; 3] {
        self.state.set().grid().shape()
    }

    fn read_box(&self, part: &Box3, out: &mut [P]) -> Result<()> {
        self.each(part, |at, state, voxel| {
            let distance = self.method.distance(state, voxel).min(self.farthest);
            out[at] = P::from_f64(distance);
        })
    }
}

impl<M: DistanceMethod> BoxSource<u32> for Values<M> {
    fn shape(&self) -> [i64; 3] {
        self.state.set().grid().shape()
    }

    fn read_box(&self, part: &Box3, out: &mut [u32]) -> Result<()> {
        self.each(part, |at, state, _| out[at] = M::source(state).unwrap_or(NO_SOURCE))
    }
}
