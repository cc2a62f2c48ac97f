//! What a solved distance can be read as: distances and the indices of nearest sources, both made out of the state of
//! the method as they are read, so that no second field is stored.

use std::io::{self, Write};
use std::sync::{Arc, OnceLock};

use crate::error::Result;
use crate::exec::{Workers, read_with_borrowed};
use crate::grid::{Box3, NO_SOURCE};
use crate::kernel::distance::state::method::DistanceState;
use crate::kernel::distance::state::precision::Precision;
use crate::store::checkpoint::SavedField;
use crate::store::{BoxSource, BrickArray};

/// A solved distance.
pub struct Solved<'a, P> {
    /// Distances in physical units, none above the farthest asked for; infinite where no source is known.
    pub values: Arc<dyn BoxSource<P> + Send + 'a>,
    /// For each voxel the index of its nearest known source, or [`NO_SOURCE`].
    pub sources: Arc<dyn BoxSource<u32> + Send + 'a>,
    /// Both at once, where they are made of the same and that is cheaper.
    pub with_source: Option<Arc<dyn DistanceWithSource<P> + Send + 'a>>,
    /// 1 where a source fixed the voxel, else 0.
    pub fixed: Arc<dyn BoxSource<u8> + Send + 'a>,
    /// The state of the method, where a checkpoint of a front that has ended holds nothing else.
    pub state: Option<Arc<dyn SavedField + Send + 'a>>,
    /// Voxels that sources fixed.
    pub fixed_voxels: u64,
    /// Distances from a voxel to a triangle that were computed to fix them.
    pub triangle_distances: u64,
}

/// Distances and sources that are made of the same state.
pub trait DistanceWithSource<P>: Sync {
    /// Reads both for a box, dense `[z][y][x]`.
    ///
    /// # Errors
    /// When they cannot be read.
    fn read_both(&self, part: &Box3, values: &mut [P], sources: &mut [u32]) -> Result<()>;
}

impl<P: Precision> Solved<'_, P> {
    /// Reads distances and sources of a box, dense `[z][y][x]`.
    ///
    /// # Errors
    /// When they cannot be read.
    pub fn read_both(&self, part: &Box3, values: &mut [P], sources: &mut [u32]) -> Result<()> {
        if let Some(with_source) = &self.with_source {
            return with_source.read_both(part, values, sources);
        }
        self.values.read_box(part, values)?;
        self.sources.read_box(part, sources)
    }
}

/// A method's state, read as distances or sources.
pub(crate) struct Values<M: DistanceState> {
    pub(crate) method: M,
    pub(crate) state: BrickArray<M::State>,
    /// Bricks of other ranks that this one reads when all is solved.
    pub(crate) borrowed: OnceLock<BrickArray<M::State>>,
    pub(crate) farthest: f64,
    /// Kept from one read to the next: fresh memory would cost more than what is computed in it.
    pub(crate) buffers: Workers<Vec<M::State>>,
}

impl<M: DistanceState> Values<M> {
    /// What was solved, where sources too are made of the state.
    pub(crate) fn read<'a, P: Precision>(self: &Arc<Self>, fixed_voxels: u64, triangle_distances: u64) -> Solved<'a, P>
    where
        M: 'a,
    {
        let (values, with_source) = (self.clone(), None);
        let (sources, fixed) = (values.clone(), values.clone());
        let state: Arc<dyn SavedField + Send + 'a> = values.clone();
        Solved { values, sources, with_source, fixed, state: Some(state), fixed_voxels, triangle_distances }
    }

    /// Reads the state of a box and hands each voxel on, with its place in the box.
    fn each(&self, part: &Box3, mut f: impl FnMut(usize, M::State, [i64; 3])) -> Result<()> {
        self.buffers.with(|states| {
            states.resize(part.len().max(states.len()), M::UNKNOWN);
            read_with_borrowed(&self.state, self.borrowed.get(), part, &mut states[..part.len()])?;
            let mut at = 0;
            for (y, z) in part.rows() {
                for x in part.lo[0]..part.hi[0] {
                    f(at, states[at], [x, y, z]);
                    at += 1;
                }
            }
            Ok(())
        })
    }
}

impl<M: DistanceState> SavedField for Values<M> {
    fn saved_bytes(&self) -> u64 {
        self.state.saved_bytes()
    }

    fn save(&self, out: &mut dyn Write, goes_on: &dyn Fn() -> io::Result<()>) -> io::Result<()> {
        self.state.save(out, goes_on)
    }
}

impl<M: DistanceState, P: Precision> BoxSource<P> for Values<M> {
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

impl<M: DistanceState> BoxSource<u8> for Values<M> {
    fn shape(&self) -> [i64; 3] {
        self.state.set().grid().shape()
    }

    fn read_box(&self, part: &Box3, out: &mut [u8]) -> Result<()> {
        self.each(part, |at, state, _| out[at] = u8::from(M::is_fixed(state)))
    }
}

impl<M: DistanceState> BoxSource<u32> for Values<M> {
    fn shape(&self) -> [i64; 3] {
        self.state.set().grid().shape()
    }

    fn read_box(&self, part: &Box3, out: &mut [u32]) -> Result<()> {
        self.each(part, |at, state, _| out[at] = M::source(state).unwrap_or(NO_SOURCE))
    }
}
