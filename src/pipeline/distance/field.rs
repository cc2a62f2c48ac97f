//! What a solved distance can be read as: distances and the indices of nearest sources, both made out of the state of
//! the method as they are read, so that no second field is stored.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::error::Result;
use crate::exec::{Stage, Workers};
use crate::grid::{Box3, BrickGrid, BrickId, BrickSet, DataSets};
use crate::kernel::distance::extent::extent;
use crate::kernel::distance::initialise::NO_SOURCE;
use crate::kernel::distance::method::DistanceMethod;
use crate::kernel::distance::precision::Precision;
use crate::kernel::image::labels;
use crate::store::{BoxSource, BrickArray};

/// A solved distance.
pub struct Solved<'a, P> {
    /// Distances in physical units, none above the farthest asked for; infinite where no source is known.
    pub values: Arc<dyn BoxSource<P> + Send + 'a>,
    /// For each voxel the index of its nearest known source, or [`NO_SOURCE`].
    pub sources: Arc<dyn BoxSource<u32> + Send + 'a>,
    /// Both at once, where they are made of the same and that is cheaper.
    pub together: Option<Arc<dyn Together<P> + Send + 'a>>,
    /// 1 where a source fixed the voxel, else 0.
    pub fixed: Arc<dyn BoxSource<u8> + Send + 'a>,
    /// Voxels that sources fixed.
    pub fixed_voxels: u64,
    /// Distances from a voxel to a triangle that were computed to fix them.
    pub triangle_distances: u64,
}

/// Distances and sources that are made of the same state.
pub trait Together<P>: Sync {
    /// Reads both for a box, dense `[z][y][x]`.
    ///
    /// # Errors
    /// When they cannot be read.
    fn read_together(&self, part: &Box3, values: &mut [P], sources: &mut [u32]) -> Result<()>;
}

/// Edge of the boxes that all voxels are looked at in: a second look reads two voxels more around each, whatever bricks
/// it cuts.
const LOOK_EDGE: i64 = 64;

/// These boxes.
pub(super) fn boxes_to_look_at(grid: &BrickGrid) -> BrickGrid {
    BrickGrid::new(grid.shape(), LOOK_EDGE.max(grid.edge()))
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
    /// Looks at every voxel; counts those of each label where `labelled` says which data set a source belongs to.
    ///
    /// # Errors
    /// When the run is interrupted.
    pub fn measure(
        &self,
        stage: &Stage<'_>,
        set: &BrickSet,
        labelled: Option<&DataSets>,
    ) -> Result<(Measured, BTreeMap<u32, u64>)> {
        let boxes = boxes_to_look_at(set.grid());
        let ids: Vec<BrickId> = (0..boxes.len()).collect();
        let workers = Workers::new(|| (Vec::new(), Vec::new(), Vec::new()));
        let parts = stage.run(&ids, &workers, |(values, sources, labels_of_voxels), &id| {
            let part = boxes.brick_box(id);
            values.resize(part.len(), P::default());
            let mut counts = BTreeMap::new();
            if let Some(sets) = labelled {
                sources.resize(part.len(), NO_SOURCE);
                self.read_both(&part, values, sources)?;
                counts = labels::count_sources(sets, sources, labels_of_voxels);
            } else {
                self.values.read_box(&part, values)?;
            }
            let (max, unlabelled_voxels) = extent(values);
            Ok((Measured { max, unlabelled_voxels }, counts))
        })?;
        let mut all = (Measured::default(), BTreeMap::<u32, u64>::new());
        for (measured, counts) in parts {
            all.0.max = all.0.max.max(measured.max);
            all.0.unlabelled_voxels += measured.unlabelled_voxels;
            for (label, n) in counts {
                *all.1.entry(label).or_default() += n;
            }
        }
        Ok(all)
    }

    /// Reads distances and sources of a box.
    fn read_both(&self, part: &Box3, values: &mut [P], sources: &mut [u32]) -> Result<()> {
        if let Some(together) = &self.together {
            return together.read_together(part, values, sources);
        }
        self.values.read_box(part, values)?;
        self.sources.read_box(part, sources)
    }
}

/// A method's state, read as distances or sources.
pub(super) struct Values<M: DistanceMethod> {
    pub(super) method: M,
    pub(super) state: BrickArray<M::State>,
    pub(super) farthest: f64,
    /// Kept from one read to the next: fresh memory would cost more than what is computed in it.
    pub(super) buffers: Workers<Vec<M::State>>,
}

impl<M: DistanceMethod> Values<M> {
    /// What was solved, where sources too are made of the state.
    pub(super) fn solved<'a, P: Precision>(self, fixed_voxels: u64, triangle_distances: u64) -> Solved<'a, P>
    where
        M: 'a,
    {
        let (values, together) = (Arc::new(self), None);
        let (sources, fixed) = (values.clone(), values.clone());
        Solved { values, sources, together, fixed, fixed_voxels, triangle_distances }
    }

    /// Reads the state of a box and hands each voxel on, with its place in the box.
    fn each(&self, part: &Box3, mut f: impl FnMut(usize, M::State, [i64; 3])) -> Result<()> {
        self.buffers.with(|states| {
            states.resize(part.len().max(states.len()), M::UNKNOWN);
            self.state.read_box(part, &mut states[..part.len()])?;
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

impl<M: DistanceMethod> BoxSource<u8> for Values<M> {
    fn shape(&self) -> [i64; 3] {
        self.state.set().grid().shape()
    }

    fn read_box(&self, part: &Box3, out: &mut [u8]) -> Result<()> {
        self.each(part, |at, state, _| out[at] = u8::from(M::is_fixed(state)))
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
