//! The nearest source of every voxel of a box, and how far it is, exactly: f64, to triangles Eberly 1999.
//!
//! Boxes are halved, and each half is left the sources that can be nearest to one of its voxels (`culling`), until these are so
//! few, or the voxels, that each voxel asks all of them.

use super::culling::{Around, Candidate, Culling, nearest_of};
use super::halves::halves;
use super::labelled_shapes::LabelledShapes;
use super::source_trees::SourceTrees;
use crate::grid::{Box3, Geometry};

/// Sources times voxels that are asked at once: fewer are told sooner than what else could be left out.
const AT_ONCE: usize = 48;

/// To what distances are told.
#[derive(Clone, Copy, Debug)]
pub struct ExactSources<'a> {
    /// The grid.
    pub geometry: &'a Geometry,
    /// All sources.
    pub shapes: &'a LabelledShapes<'a>,
    /// The same, sorted.
    pub trees: &'a SourceTrees,
    /// Boxes that are farther from all of them are passed over. Physical.
    pub farthest: f64,
}

/// Work buffers.
#[derive(Clone, Debug, Default)]
pub struct Work {
    pub(super) candidates: Vec<Candidate>,
    pub(super) culling: Culling,
}

/// The nearest of some sources, its label, and the squared distance to it.
pub(super) struct Nearest {
    pub(super) source: u32,
    pub(super) label: u32,
    squared: f64,
}

/// Bytes that the buffers take with so many sources: all of them, and what of them is left in the halves of boxes.
#[must_use]
pub fn work_bytes(sources: u64) -> u64 {
    sources * (4 * size_of::<Candidate>() + size_of::<([f64; 3], f64)>()) as u64
}

impl ExactSources<'_> {
    /// Calls `report` with the place of each voxel in a box, dense `[z][y][x]`, its nearest source and the squared distance to
    /// that. Of equal distances the lower label wins, then the lower source. Of voxels farther away than counts some are left
    /// out.
    pub fn nearest(&self, part: &Box3, work: &mut Work, report: &mut impl FnMut(usize, u32, f64)) {
        if part.is_empty() {
            return;
        }
        work.candidates = self.trees.near_all(&Around::centres(self.geometry, part));
        self.settle(part, work, 0, &mut |voxel, among: &[Candidate]| {
            if let Some(nearest) = self.nearest_of(voxel, among) {
                report(part.offset_of(voxel), nearest.source, nearest.squared);
            }
        });
    }

    /// Calls `ask` for each voxel of a box with some sources, the nearest among them. Those from `first` on hold all that can be.
    fn settle(&self, part: &Box3, work: &mut Work, first: usize, ask: &mut impl FnMut([i64; 3], &[Candidate])) {
        let left = work.candidates.len();
        if (left - first) * part.len() <= AT_ONCE || part.len() == 1 {
            for (y, z) in part.rows() {
                (part.lo[0]..part.hi[0]).for_each(|x| ask([x, y, z], &work.candidates[first..]));
            }
            return;
        }
        let around = Around::centres(self.geometry, part);
        let nearest = work.culling.keep(self.shapes, &around, &mut work.candidates, first);
        if around.least(nearest) <= self.farthest {
            for half in halves(part) {
                self.settle(&half, work, left, ask);
            }
        }
        work.candidates.truncate(left);
    }

    /// The nearest of some sources to a voxel.
    pub(super) fn nearest_of(&self, voxel: [i64; 3], among: &[Candidate]) -> Option<Nearest> {
        let nearest = nearest_of(self.shapes, self.geometry.position(voxel), among);
        nearest.map(|(squared, label, source)| Nearest { source, label, squared })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{DataSets, TriangleMesh};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_voxel_has_the_nearest_of_all_sources(
            points in prop::collection::vec([-2.0..14.0, -2.0..14.0, -2.0..14.0_f64], 1..40),
            corners in prop::collection::vec([-2.0..14.0, -2.0..14.0, -2.0..14.0_f64], 3..30),
            small in prop::collection::vec([4.0..7.0, 4.0..7.0, 4.0..7.0_f64], 0..120),
            shape in [1_i64..14, 1_i64..14, 1_i64..14],
        ) {
            let mut sets = DataSets::default();
            sets.add_cloud(&points);
            // Many triangles that are small beside boxes of voxels.
            let around = |p: &[f64; 3]| [[p[0] + 0.2, p[1], p[2]], [p[0], p[1] - 0.1, p[2] + 0.1], *p];
            let vertices: Vec<[f64; 3]> = corners.iter().copied().chain(small.iter().flat_map(around)).collect();
            let triangles = (0..corners.len() as u32 / 3).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]);
            let first = corners.len() as u32;
            let small = (0..small.len() as u32).map(|n| [first + 3 * n, first + 3 * n + 1, first + 3 * n + 2]);
            sets.add_mesh(&TriangleMesh { vertices, triangles: triangles.chain(small).collect() });
            let geometry = Geometry { shape, spacing: [1.0, 0.7, 1.3], origin: [0.3, -0.2, 0.1], unit: None };
            let (shapes, trees) = (LabelledShapes::new(&sets), SourceTrees::new(&sets));
            let exact = ExactSources { geometry: &geometry, shapes: &shapes, trees: &trees, farthest: f64::INFINITY };
            let part = geometry.domain();
            let mut found = vec![None; part.len()];
            exact.nearest(&part, &mut Work::default(), &mut |at, source, squared| found[at] = Some((source, squared)));
            for (y, z) in part.rows() {
                for x in 0..shape[0] {
                    let here = geometry.position([x, y, z]);
                    let all = (0..sets.len() as u32).map(|source| shapes.distance_squared(here, source));
                    let least = all.fold(f64::INFINITY, f64::min);
                    let (source, squared) = found[part.offset_of([x, y, z])].unwrap();
                    prop_assert_eq!(squared, least);
                    prop_assert_eq!(shapes.distance_squared(here, source), least);
                }
            }
        }
    }
}
