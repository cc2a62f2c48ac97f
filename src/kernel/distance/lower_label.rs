//! The tie rule of labels: of sources that are equally near a voxel the one of the lower label counts.
//!
//! A method keeps the source that it found first, and which one that is hangs on the order in which it visits voxels.
//! Beside a voxel that is equally far from two sources lie voxels that are nearer to the one and to the other. So the
//! sources of its face neighbours are those to compare with, wherever one of them has a lower label. For methods that
//! track sources the second look compares their distances. The Eikonal methods keep to their published rules
//! of parents: they take the source of the way on which distance came.

use super::second_look::Look;
use crate::grid::{Box3, DataSets, FACES, Face};
use crate::kernel::image::labels;

/// Finds voxels beside others of a lower label.
#[derive(Clone, Debug, Default)]
pub(super) struct LowerLabels {
    /// Labels of the voxels that are known, 0 where there is no source.
    labels: Vec<u32>,
    /// Voxels of a row with a lower label beside them.
    flagged: Vec<u8>,
}

impl LowerLabels {
    /// Calls `ask` with each voxel of the part that has a face neighbour of a lower label, and with that one's source.
    pub(super) fn each(&mut self, look: &Look<'_>, sets: &DataSets, mut ask: impl FnMut([i64; 3], u32)) {
        let Look { part, known, found, .. } = *look;
        labels::of_sources(sets, found, &mut self.labels);
        for (y, z) in part.rows() {
            self.flag(part, known, y, z);
            for (x, _) in (part.lo[0]..).zip(&self.flagged).filter(|(_, flagged)| **flagged != 0) {
                let own = self.labels[known.offset_of([x, y, z])];
                for face in FACES.into_iter().filter(|face| known.contains(beside([x, y, z], *face))) {
                    let at = known.offset_of(beside([x, y, z], face));
                    if is_lower(self.labels[at], own) {
                        ask([x, y, z], found[at]);
                    }
                }
            }
        }
    }

    fn flag(&mut self, part: &Box3, known: &Box3, y: i64, z: i64) {
        let width = part.shape()[0] as usize;
        self.flagged.clear();
        self.flagged.resize(width, 0);
        let here = &self.labels[known.offset_of([part.lo[0], y, z])..][..width];
        for face in FACES {
            let there = Box3::new(beside([part.lo[0], y, z], face), beside([part.hi[0], y + 1, z + 1], face));
            let within = there.intersect(known);
            if within.is_empty() {
                continue;
            }
            let first = (within.lo[0] - there.lo[0]) as usize;
            let beside = &self.labels[known.offset_of(within.lo)..][..within.shape()[0] as usize];
            for ((flagged, here), beside) in self.flagged[first..].iter_mut().zip(&here[first..]).zip(beside) {
                *flagged |= u8::from(is_lower(*beside, *here));
            }
        }
    }
}

/// Whether a voxel of the first label has a source, and a lower label than the second.
fn is_lower(label: u32, than: u32) -> bool {
    // Without branches, so that lanes stay together: 0 is the largest of all.
    label.wrapping_sub(1) < than.wrapping_sub(1)
}

fn beside(mut voxel: [i64; 3], face: Face) -> [i64; 3] {
    voxel[face.axis] += if face.upper { 1 } else { -1 };
    voxel
}
