//! The labels of the sources that voxels have.

use crate::grid::{DataSets, NO_SOURCE};

/// Sources whose labels are looked up at once.
const AT_ONCE: usize = 64;

/// The labels of voxels by their sources, into `out`; 0 for those without one.
pub(crate) fn of_sources(sets: &DataSets, sources: &[u32], out: &mut Vec<u32>) {
    out.clear();
    let mut known = sets.run_of(NO_SOURCE);
    for few in sources.chunks(AT_ONCE) {
        // Neighbours mostly have one label: whether they do costs less than to look at each.
        let (lo, hi) = few.iter().fold((u32::MAX, 0), |(lo, hi), &source| (lo.min(source), hi.max(source)));
        if known.0.contains(&lo) && known.0.contains(&hi) {
            out.resize(out.len() + few.len(), known.1);
            continue;
        }
        out.extend(few.iter().map(|source| {
            if !known.0.contains(source) {
                known = sets.run_of(*source);
            }
            known.1
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_have_the_labels_of_their_sets() {
        let mut sets = DataSets::default();
        sets.add_labelled(4, &[[0.0; 3]; 2]);
        sets.add_labelled(9, &[[1.0; 3]]);
        let mut labels = vec![7];
        of_sources(&sets, &[2, 2, 0, 1, u32::MAX], &mut labels);
        assert_eq!(labels, [9, 9, 4, 4, 0]);
    }
}
