//! Objects on one grid, each voxel of one of them at most.

use crate::error::Result;
use crate::grid::{Box3, Geometry};
use crate::pipeline::segment::labels::{LabelVolume, Overlap};
use crate::store::{BoxSource, BrickArray, Element};

/// How wide a gap between objects is filled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FillGaps {
    /// Up to this width, a length.
    Width(f64),
    /// As wide as the gaps between facing surfaces are.
    Auto,
}

/// How objects are joined.
pub struct Joining<'a> {
    /// The grid of the image.
    pub geometry: &'a Geometry,
    /// The image, taken to [0, 1], on that grid; none where it is not to be looked at.
    pub image: Option<&'a dyn BoxSource<f32>>,
    /// Which object gets the voxels where several overlap.
    pub overlap: Overlap,
    /// How wide a gap between objects is filled; none leaves them as they are.
    pub fill: Option<FillGaps>,
}

/// What was found in joining.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Found {
    /// Voxels that several objects claimed, none of them nested in another, and that went to the one they lie deeper in.
    pub contested: u64,
    /// Pairs of labels: an object, and the smallest that it is nested in.
    pub nested: Vec<[u32; 2]>,
    /// Gaps were filled up to this width.
    pub gap_width: Option<f64>,
    /// Voxels of gaps that got a label.
    pub filled: u64,
    /// Voxels that changed from one object to another as gaps were shared out.
    pub moved: u64,
    /// Brightness within objects and between them, in [0, 1], where walls were looked for in the image.
    pub wall: Option<[f64; 2]>,
}

/// The label volume of joined objects.
pub struct Joined<'a> {
    pub(super) painted: LabelVolume<'a>,
    /// Labels on some bricks; later ones stand over former ones.
    pub(super) settled: Vec<BrickArray<u32>>,
    /// What was found.
    pub found: Found,
}

impl<T: Element> BoxSource<T> for Joined<'_> {
    fn shape(&self) -> [i64; 3] {
        BoxSource::<T>::shape(&self.painted)
    }

    fn read_box(&self, part: &Box3, out: &mut [T]) -> Result<()> {
        self.painted.read_box(part, out)?;
        let mut labels = Vec::new();
        for settled in &self.settled {
            let grid = settled.set().grid();
            for id in grid.bricks_in(part).filter(|&id| settled.set().slot(id).is_some()) {
                let shared = grid.brick_box(id).intersect(part);
                labels.resize(shared.len(), 0);
                settled.read_box(&shared, &mut labels)?;
                for (row, (y, z)) in labels.chunks_exact(shared.shape()[0] as usize).zip(shared.rows()) {
                    let out = &mut out[part.offset_of([shared.lo[0], y, z])..][..row.len()];
                    out.iter_mut().zip(row).for_each(|(out, &label)| *out = T::from_f64(f64::from(label)));
                }
            }
        }
        Ok(())
    }

    fn constant_in(&self, part: &Box3) -> Option<T> {
        let is_settled =
            |settled: &BrickArray<u32>| settled.set().grid().bricks_in(part).any(|id| settled.set().slot(id).is_some());
        self.painted.constant_in(part).filter(|_| !self.settled.iter().any(is_settled))
    }
}
