//! The nearest source of a label at places near the borders of labels: made ready for a box at once, so that a place
//! asks a handful of sources instead of a tree of all.
//!
//! The box is cut into blocks, and these into smaller ones; a block where voxels of different labels are near keeps, for
//! each of these labels, the sources that can be nearest to one of its places (`kernel::distance::features::culling`). Where these
//! are many, as with meshes much finer than the grid, it keeps none, and its places ask the tree.

use std::ops::Range;

use crate::grid::{Box3, Geometry};
use crate::kernel::distance::features::culling::{Around, Candidate, Culling};
use crate::kernel::distance::features::labelled_shapes::LabelledShapes;
use crate::kernel::distance::features::source_trees::SourceTrees;

/// Edges of the blocks, in cells: trees are asked for the first.
const EDGES: [i64; 2] = [16, 4];
/// Voxels around a block whose labels count: those one around the corners of its cells, and one around these.
const AROUND: i64 = 2;

/// Sources of a label that a large and a small block keep at most: a tree is asked in the time of some hundred of them.
const MOST: [usize; 2] = [4096, 128];

/// Sources near the borders of labels in one box.
#[derive(Clone, Debug)]
pub struct Nearby {
    cells: Box3,
    /// The lists of each small block, dense `[z][y][x]`, as places in `lists`.
    blocks: Vec<Range<usize>>,
    /// Labels, and where their sources are in `sources`; nowhere where they are many.
    lists: Vec<(u32, Range<usize>)>,
    sources: Vec<Candidate>,
    culling: Culling,
}

impl Default for Nearby {
    fn default() -> Self {
        let cells = Box3::from_shape([0; 3]);
        let (blocks, lists, sources, culling) = Default::default();
        Self { cells, blocks, lists, sources, culling }
    }
}

impl Nearby {
    /// Makes ready for the cells between the voxels of a box, of which the labels are known, dense `[z][y][x]`.
    pub fn enter(
        &mut self,
        geometry: &Geometry,
        shapes: &LabelledShapes<'_>,
        trees: &SourceTrees,
        part: &Box3,
        labels: &[u32],
    ) {
        self.cells = cells_between(part);
        self.lists.clear();
        self.sources.clear();
        self.blocks.clear();
        self.blocks.resize(Box3::from_shape(counts(&self.cells, EDGES[1])).len(), 0..0);
        for large in blocks(self.cells, EDGES[0]) {
            let near = labels_near(part, labels, &large);
            if near.len() < 2 {
                continue;
            }
            let around = Around::cells(geometry, &large);
            let mut of_label = |label: &u32| {
                let few = trees.near(*label, &around, MOST[0]).map(|all| self.culled(shapes, &around, all));
                (*label, few.unwrap_or_default())
            };
            let coarse: Vec<(u32, Vec<Candidate>)> = near.iter().map(&mut of_label).collect();
            for small in blocks(large, EDGES[1]) {
                self.enter_block(geometry, shapes, &small, &labels_near(part, labels, &small), &coarse);
            }
        }
    }

    /// Bytes of memory that stay between boxes.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        let of_blocks = self.blocks.capacity() * size_of::<Range<usize>>();
        let of_lists = self.lists.capacity() * size_of::<(u32, Range<usize>)>();
        let of_sources = self.sources.capacity() * size_of::<Candidate>();
        (of_blocks + of_lists + of_sources) as u64 + self.culling.bytes()
    }

    /// Keeps what a small block needs of the sources, by label, of the large one around it; of none where they are many.
    fn enter_block(
        &mut self,
        geometry: &Geometry,
        shapes: &LabelledShapes<'_>,
        block: &Box3,
        near: &[u32],
        coarse: &[(u32, Vec<Candidate>)],
    ) {
        if near.len() < 2 {
            return;
        }
        let (around, first) = (Around::cells(geometry, block), self.lists.len());
        for (label, sources) in coarse.iter().filter(|(label, _)| near.contains(label)) {
            let kept = self.culled(shapes, &around, sources.clone());
            let start = self.sources.len();
            self.sources.extend(kept.iter().take_while(|_| kept.len() <= MOST[1]));
            self.lists.push((*label, start..self.sources.len()));
        }
        let at = self.place(block.lo);
        self.blocks[at] = first..self.lists.len();
    }

    fn culled(&mut self, shapes: &LabelledShapes<'_>, around: &Around, mut all: Vec<Candidate>) -> Vec<Candidate> {
        let count = all.len();
        self.culling.keep(shapes, around, &mut all, 0);
        all.split_off(count)
    }

    /// The number of a label's source that is nearest to a place, in voxel units and in the world; none where the label
    /// is not near. Of equal distances the lower source where they are few.
    #[must_use]
    pub fn nearest(
        &self,
        shapes: &LabelledShapes<'_>,
        trees: &SourceTrees,
        label: u32,
        place: [f64; 3],
        world: [f64; 3],
    ) -> Option<u32> {
        let cell = std::array::from_fn(|a| {
            let last = (self.cells.hi[a] - 1).max(self.cells.lo[a]);
            (place[a].floor() as i64).clamp(self.cells.lo[a], last)
        });
        let lists = &self.lists[self.blocks[self.place(cell)].clone()];
        let (_, range) = lists.iter().find(|(of, _)| *of == label)?;
        if range.is_empty() {
            return Some(trees.nearest(label, world));
        }
        let rank = |&(source, _): &Candidate| (shapes.distance_squared(world, source), source);
        let ranked = self.sources[range.clone()].iter().map(rank);
        ranked.reduce(|best, next| if next < best { next } else { best }).map(|(_, source)| source)
    }

    /// Puts the nearest sources of their labels in the place of those that voxels near borders track, so that what is
    /// made of these hangs on labels alone. All dense over the box that was entered.
    pub fn settle(
        &self,
        geometry: &Geometry,
        shapes: &LabelledShapes<'_>,
        trees: &SourceTrees,
        labels: &[u32],
        sources: &mut [u32],
    ) {
        let part = Box3::new(self.cells.lo, self.cells.hi.map(|v| v + 1));
        let mut at = 0;
        for (y, z) in part.rows() {
            for voxel in (part.lo[0]..part.hi[0]).map(|x| [x, y, z]) {
                let place = voxel.map(|v| v as f64);
                if let Some(nearest) = self.nearest(shapes, trees, labels[at], place, geometry.position(voxel)) {
                    sources[at] = nearest;
                }
                at += 1;
            }
        }
    }

    /// The place of the small block that a cell lies in.
    fn place(&self, cell: [i64; 3]) -> usize {
        let at: [i64; 3] = std::array::from_fn(|a| (cell[a] - self.cells.lo[a]) / EDGES[1]);
        Box3::from_shape(counts(&self.cells, EDGES[1])).offset_of(at)
    }
}

/// The cells between the voxels of a box, by their lowest corners.
fn cells_between(part: &Box3) -> Box3 {
    Box3::new(part.lo, part.hi.map(|v| v - 1))
}

/// Blocks of so many cells along each axis.
fn counts(cells: &Box3, edge: i64) -> [i64; 3] {
    cells.shape().map(|n| (n + edge - 1) / edge)
}

/// The blocks of cells of that edge that some cells are cut into.
fn blocks(cells: Box3, edge: i64) -> impl Iterator<Item = Box3> {
    let at = Box3::from_shape(counts(&cells, edge));
    let block = move |at: [i64; 3]| {
        let lo: [i64; 3] = std::array::from_fn(|a| cells.lo[a] + edge * at[a]);
        Box3::new(lo, lo.map(|v| v + edge)).intersect(&cells)
    };
    at.rows().flat_map(move |(y, z)| (0..at.hi[0]).map(move |x| block([x, y, z])))
}

/// The labels of the voxels around a block of cells, ascending; without 0, which is none.
fn labels_near(part: &Box3, labels: &[u32], block: &Box3) -> Vec<u32> {
    let near = Box3::new(block.lo, block.hi.map(|v| v + 1)).grow(AROUND).intersect(part);
    let mut found = Vec::new();
    for (y, z) in near.rows() {
        let row = &labels[part.offset_of([near.lo[0], y, z])..][..near.shape()[0] as usize];
        // Equal labels come in long runs.
        for run in row.chunk_by(|a, b| a == b).filter(|run| run[0] > 0) {
            if !found.contains(&run[0]) {
                found.push(run[0]);
            }
        }
    }
    found.sort_unstable();
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::DataSets;

    /// Every source of every label is asked, at places all over the cells that have two labels around: of few sources,
    /// of more than small blocks keep, of more than large ones do.
    #[test]
    fn the_nearest_of_a_label_is_that_of_all() {
        [60, 1500, 6000].into_iter().for_each(check);
    }

    fn check(count: usize) {
        let geometry = Geometry { shape: [23, 19, 21], spacing: [0.5, 0.4, 0.7], origin: [3.0, -2.0, 1.0], unit: None };
        let part = geometry.domain();
        let spread = |n: usize| [2.0_f64, 3.0, 5.0].map(|root| (n as f64 * root.sqrt()).fract());
        let within = |share: [f64; 3]| std::array::from_fn(|a| share[a] * (geometry.shape[a] - 1) as f64);
        let world = |place: [f64; 3]| std::array::from_fn(|a| geometry.origin[a] + place[a] * geometry.spacing[a]);
        let points: Vec<[f64; 3]> = (1..=3 * count).map(|n| world(within(spread(n)))).collect();
        let mut sets = DataSets::default();
        points.chunks(count).for_each(|cloud| sets.add_cloud(cloud));
        let (shapes, trees) = (LabelledShapes::new(&sets), SourceTrees::new(&sets));
        let squared =
            |here: [f64; 3], source: usize| (0..3).map(|a| (here[a] - points[source][a]).powi(2)).sum::<f64>();
        let nearest = |here: [f64; 3], among: Range<usize>| {
            among.min_by(|&a, &b| squared(here, a).total_cmp(&squared(here, b))).unwrap() as u32
        };
        let voxels = part.rows().flat_map(|(y, z)| (part.lo[0]..part.hi[0]).map(move |x| [x, y, z]));
        let labels: Vec<u32> = voxels.map(|v| sets.label(nearest(geometry.position(v), 0..3 * count))).collect();
        let mut nearby = Nearby::default();
        nearby.enter(&geometry, &shapes, &trees, &part, &labels);
        let mut found = 0;
        for place in (200..2200).map(|n| within(spread(n))) {
            let here = world(place);
            for label in 1..=3_u32 {
                let own = count * (label as usize - 1)..count * label as usize;
                if let Some(source) = nearby.nearest(&shapes, &trees, label, place, here) {
                    assert_eq!(source, nearest(here, own), "{place:?}");
                    found += 1;
                }
            }
        }
        assert!(found > 2000, "{found}");
        let longest = nearby.lists.iter().map(|(_, range)| range.len()).max();
        assert!(longest.is_some_and(|longest| longest <= MOST[1]), "{longest:?}");
        assert_eq!(nearby.lists.iter().any(|(_, range)| range.is_empty()), count > 60);
    }
}
