//! Which voxels of a box have a source of the wrong label, exactly.
//!
//! Boxes are halved, and each half is left the sources that can be nearest to one of its voxels (`culling`), until all
//! that are left have one label, or until the half is a voxel. Only near the borders of labels this goes down to voxels,
//! with a handful of sources each.

use super::culling::{Around, Candidate};
use super::exact_sources::{ExactSources, Work};
use super::halves::halves;
use crate::grid::Box3;

impl ExactSources<'_> {
    /// The voxels of a box whose sources, dense over it, have a label that is not the nearest; each with its nearest
    /// source. Of equal distances the lower label wins, then the lower source. Where all of a part of the box is farther away
    /// than counts, nothing is looked for; of other parts some voxels beyond may be among them.
    #[must_use]
    pub fn corrections(&self, part: &Box3, sources: &[u32]) -> Vec<([i64; 3], u32)> {
        let mut found = Vec::new();
        let around = Around::centres(self.geometry, part);
        let mut work = Work { candidates: self.trees.near_all(&around), ..Work::default() };
        self.settle_labels(part, &mut work, 0, &mut |voxels, left| {
            for (y, z) in voxels.rows() {
                for voxel in (voxels.lo[0]..voxels.hi[0]).map(|x| [x, y, z]) {
                    if self.shapes.label(sources[part.offset_of(voxel)]) != left[0].1 {
                        found.extend(self.nearest_of(voxel, left).map(|nearest| (voxel, nearest.source)));
                    }
                }
            }
        });
        found
    }

    /// Tells for all voxels of a box whose they are: calls `report` with boxes of voxels and sources of one label, which
    /// those nearest to the voxels are among. The candidates from `first` on hold all that can be nearest.
    fn settle_labels(&self, part: &Box3, work: &mut Work, first: usize, report: &mut impl FnMut(&Box3, &[Candidate])) {
        let left = work.candidates.len();
        if part.is_empty() || first == left {
            return;
        }
        if part.len() == 1 {
            let nearest = self.nearest_of(part.lo, &work.candidates[first..]);
            return nearest.into_iter().for_each(|nearest| report(part, &[(nearest.source, nearest.label)]));
        }
        let around = Around::centres(self.geometry, part);
        let nearest = work.culling.keep(self.shapes, &around, &mut work.candidates, first);
        if around.least(nearest) > self.farthest {
            return work.candidates.truncate(left);
        }
        let kept = &work.candidates[left..];
        if kept.iter().all(|(_, label)| *label == kept[0].1) {
            report(part, kept);
        } else {
            for half in halves(part) {
                self.settle_labels(&half, work, left, report);
            }
        }
        work.candidates.truncate(left);
    }
}
