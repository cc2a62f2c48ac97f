//! Where labels are near to changing: voxels beside others of another label.
//!
//! A label is wrong where a source was lost, and only beside voxels of the right one. It is right by chance where two
//! sources are equally near: which of them a method found first hangs on the order in which it visits voxels. Either way
//! a neighbour's source is hardly farther than the voxel's own.

use super::repair_box::RepairBox;
use crate::grid::{Box3, DataSets, FACES, Face, NO_SOURCE};
use crate::kernel::distance::features::source_labels;

/// Finds them.
#[derive(Clone, Debug, Default)]
pub(crate) struct LabelBorders {
    /// Labels of the voxels that are known, 0 where there is no source.
    labels: Vec<u32>,
    /// Voxels of a row with another label beside them.
    flagged: Vec<u8>,
}

impl LabelBorders {
    /// Calls `report` with each voxel of the part that has face neighbours of other labels, and with their sources.
    pub(crate) fn each(
        &mut self,
        repair_box: &RepairBox<'_>,
        sets: &DataSets,
        mut report: impl FnMut([i64; 3], &[u32]),
    ) {
        let RepairBox { part, known, found, .. } = *repair_box;
        source_labels::of_sources(sets, found, &mut self.labels);
        for (y, z) in part.rows() {
            self.flag(part, known, y, z);
            for (x, _) in (part.lo[0]..).zip(&self.flagged).filter(|(_, flagged)| **flagged != 0) {
                let own = self.labels[known.offset_of([x, y, z])];
                let (mut others, mut count) = ([NO_SOURCE; 6], 0);
                for there in FACES.map(|face| beside([x, y, z], face)).into_iter().filter(|&v| known.contains(v)) {
                    let at = known.offset_of(there);
                    if self.labels[at] != own {
                        others[count] = found[at];
                        count += 1;
                    }
                }
                report([x, y, z], &others[..count]);
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
                *flagged |= u8::from(beside != here);
            }
        }
    }
}

fn beside(mut voxel: [i64; 3], face: Face) -> [i64; 3] {
    voxel[face.axis] += if face.upper { 1 } else { -1 };
    voxel
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Geometry;

    #[test]
    fn voxels_beside_other_labels_are_told_with_their_sources() {
        let geometry = Geometry { shape: [7, 5, 4], spacing: [1.0; 3], origin: [0.0; 3], unit: None };
        let mut sets = DataSets::default();
        sets.add_cloud(&[[0.0; 3]; 5]);
        sets.add_cloud(&[[0.0; 3]; 4]);
        let domain = geometry.domain();
        // Runs of like labels, some voxels without a source.
        let source = |n: usize| if n % 23 == 5 { NO_SOURCE } else { (n / 3 * 7 % 9) as u32 };
        let all: Vec<u32> = (0..domain.len()).map(source).collect();
        for part in [domain, Box3::new([2, 1, 0], [5, 4, 3]), Box3::new([6, 4, 3], [7, 5, 4])] {
            let known = part.grow(2).intersect(&domain);
            let at = |voxel: [i64; 3]| all[domain.offset_of(voxel)];
            let mut found = Vec::new();
            for (y, z) in known.rows() {
                found.extend((known.lo[0]..known.hi[0]).map(|x| at([x, y, z])));
            }
            let mut wanted = Vec::new();
            for (y, z) in part.rows() {
                for voxel in (part.lo[0]..part.hi[0]).map(|x| [x, y, z]) {
                    let around = FACES.map(|face| beside(voxel, face)).into_iter().filter(|&v| domain.contains(v));
                    let others = around.map(at).filter(|&other| sets.label(other) != sets.label(at(voxel)));
                    let others: Vec<u32> = others.collect();
                    if !others.is_empty() {
                        wanted.push((voxel, others));
                    }
                }
            }
            let (mut borders, mut told) = (LabelBorders::default(), Vec::new());
            let repair_box = RepairBox {
                geometry: &geometry,
                part: &part,
                known: &known,
                found: &found,
                lost_within: None,
                labels: None,
            };
            borders.each(&repair_box, &sets, |voxel, others| told.push((voxel, others.to_vec())));
            assert_eq!(told, wanted);
            assert!(!told.is_empty());
        }
    }
}
