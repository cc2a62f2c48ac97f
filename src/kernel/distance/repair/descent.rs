//! The sources beside a source, and by going from one to the next the one of its label that is nearest to a place.
//!
//! Where sources were lost, the lost one lies beside the one that was kept: both are almost equally far. Around a place
//! that many sources are as far from (in the middle of a sphere) this ends at one that is nearer than all beside it.

use std::collections::HashMap;

use crate::grid::DataSets;
use crate::kernel::distance::features::source_trees::SourceTrees;

/// How many sources beside one are asked: two rings of a surface.
const BESIDE: usize = 16;
/// Sources whose neighbours are remembered at most.
const REMEMBERED: usize = 1 << 16;
/// Bytes of one that is remembered: its list and its place in the table.
const REMEMBERED_BYTES: u64 = 4 * BESIDE as u64 + 64;

/// Bytes that a thread remembers of so many sources at most.
pub(crate) fn remembered_bytes(sources: usize) -> u64 {
    sources.min(REMEMBERED) as u64 * REMEMBERED_BYTES
}

/// Sources beside others, remembered.
#[derive(Clone, Debug, Default)]
pub(crate) struct BesideSources {
    beside: HashMap<u32, Vec<u32>>,
}

impl BesideSources {
    /// The nearest source that is reached from one, each with its squared distance, by going on to the nearest beside it
    /// as long as that is nearer.
    pub(crate) fn descend(
        &mut self,
        trees: &SourceTrees,
        sets: &DataSets,
        mut from: (f64, u32),
        squared: impl Fn(u32) -> f64,
    ) -> (f64, u32) {
        loop {
            if self.beside.len() > REMEMBERED {
                self.beside.clear();
            }
            let beside = self.beside.entry(from.1).or_insert_with(|| trees.beside(sets, from.1, BESIDE));
            let nearest = beside.iter().map(|&source| (squared(source), source));
            match nearest.reduce(|best, next| if next < best { next } else { best }) {
                Some(nearest) if nearest.0 < from.0 => from = nearest,
                _ => return from,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::TriangleMesh;
    use crate::kernel::distance::features::labelled_shapes::LabelledShapes;

    /// Points on a paraboloid, in another label's company, and a strip of triangles.
    fn sets() -> DataSets {
        let (mut sets, mut points) = (DataSets::default(), Vec::new());
        for n in 0..400 {
            let (x, y) = (f64::from(n % 20) / 10.0 - 1.0, f64::from(n / 20) / 10.0 - 1.0);
            points.push([x, y, 0.3 * (x * x + 0.7 * y * y)]);
        }
        sets.add_cloud(&[[0.1, 0.2, 0.5], [0.3, 0.1, 0.4]]);
        sets.add_cloud(&points);
        let vertex = |n: u32| [f64::from(n / 2) / 8.0 - 1.5, f64::from(n % 2), 0.2];
        let vertices = (0..50).map(vertex).collect();
        sets.add_mesh(&TriangleMesh { vertices, triangles: (0..48).map(|n| [n, n + 1, n + 2]).collect() });
        sets
    }

    #[test]
    fn from_any_source_the_nearest_of_its_label_is_reached() {
        let sets = sets();
        let (trees, shapes) = (SourceTrees::new(&sets), LabelledShapes::new(&sets));
        let mut beside = BesideSources::default();
        for here in [[0.43, -0.21, 0.9], [-0.8, 0.77, -1.0], [2.0, 0.1, 0.3], [0.0, 0.0, -3.0]] {
            let squared = |source| shapes.distance_squared(here, source);
            for source in 0..sets.len() as u32 {
                let like = (0..sets.len() as u32).filter(|other| sets.label(*other) == sets.label(source));
                let nearest = like.map(squared).fold(f64::INFINITY, f64::min);
                let reached = beside.descend(&trees, &sets, (squared(source), source), squared);
                assert_eq!(reached, (nearest, reached.1), "{here:?} from {source}");
                assert_eq!((squared(reached.1), sets.label(reached.1)), (nearest, sets.label(source)));
            }
        }
    }
}
