//! The nearest source of each label, exactly, by a tree for each data set (R-trees), and whose a whole box of voxels is.

use rstar::primitives::GeomWithData;
use rstar::{AABB, PointDistance, RTree, RTreeObject};

use crate::grid::{Box3, DataSets, Geometry};
use crate::kernel::triangle::Triangle;

/// The sources of a run, by label.
#[derive(Debug)]
pub struct SourceTrees {
    trees: Vec<Tree>,
    /// The labels of the trees, ascending.
    labels: Vec<u32>,
}

/// The sources of one data set, with their numbers.
#[derive(Debug)]
enum Tree {
    Points(RTree<GeomWithData<[f64; 3], u32>>),
    Triangles(RTree<GeomWithData<Placed, u32>>),
}

/// A triangle and the box around it.
#[derive(Debug)]
struct Placed {
    triangle: Triangle,
    extent: AABB<[f64; 3]>,
}

impl RTreeObject for Placed {
    type Envelope = AABB<[f64; 3]>;

    fn envelope(&self) -> Self::Envelope {
        self.extent
    }
}

impl PointDistance for Placed {
    fn distance_2(&self, point: &[f64; 3]) -> f64 {
        self.triangle.distance_squared(*point)
    }
}

impl SourceTrees {
    /// Sorts the sources of all data sets.
    #[must_use]
    pub fn new(sets: &DataSets) -> Self {
        let points = sets.positions.len() as u32;
        let tree = |[cloud, mesh]: [std::ops::Range<u32>; 2]| {
            if mesh.is_empty() {
                let point = |n: u32| GeomWithData::new(sets.positions[n as usize], n);
                return Tree::Points(RTree::bulk_load(cloud.map(point).collect()));
            }
            let placed = |n: u32| {
                let corners = sets.mesh.corners(n as usize);
                let placed = Placed { triangle: Triangle::new(corners), extent: AABB::from_points(&corners) };
                GeomWithData::new(placed, points + n)
            };
            Tree::Triangles(RTree::bulk_load(mesh.map(placed).collect()))
        };
        Self { trees: sets.places().map(tree).collect(), labels: sets.labels().to_vec() }
    }

    /// The number of a label's source that is nearest to a world position; `u32::MAX` where the label has none.
    #[must_use]
    pub fn nearest(&self, label: u32, here: [f64; 3]) -> u32 {
        let tree = self.labels.binary_search(&label).ok();
        tree.and_then(|tree| self.look(tree, here)).map_or(u32::MAX, |(source, _)| source)
    }

    /// The voxels of a box whose sources, dense over it, have a label that is not the nearest; each with its nearest
    /// source. Of equal distances the lower label wins.
    #[must_use]
    pub fn corrections(
        &self,
        geometry: &Geometry,
        sets: &DataSets,
        part: &Box3,
        sources: &[u32],
    ) -> Vec<([i64; 3], u32)> {
        let mut found = Vec::new();
        self.settle(geometry, part, &mut |voxels, label, source| {
            for (y, z) in voxels.rows() {
                for voxel in (voxels.lo[0]..voxels.hi[0]).map(|x| [x, y, z]) {
                    if sets.label(sources[part.offset_of(voxel)]) != label {
                        let nearest = || self.nearest(label, geometry.position(voxel));
                        found.push((voxel, source.unwrap_or_else(nearest)));
                    }
                }
            }
        });
        found
    }

    /// Tells for all voxels of a box whose they are: calls `tell` with boxes of voxels, their label, and their source
    /// where it is one voxel. Of equal distances the lower label wins.
    fn settle(&self, geometry: &Geometry, part: &Box3, tell: &mut impl FnMut(&Box3, u32, Option<u32>)) {
        let all: Vec<usize> = (0..self.trees.len()).collect();
        self.settle_among(geometry, part, &all, tell);
    }

    /// The same among the trees that can be nearest there.
    fn settle_among(
        &self,
        geometry: &Geometry,
        part: &Box3,
        among: &[usize],
        tell: &mut impl FnMut(&Box3, u32, Option<u32>),
    ) {
        if part.is_empty() {
            return;
        }
        if let [only] = among {
            return tell(part, self.labels[*only], None);
        }
        let (lo, hi) = (geometry.position(part.lo), geometry.position(part.hi.map(|v| v - 1)));
        let middle = std::array::from_fn(|a| 0.5 * (lo[a] + hi[a]));
        let reach = 0.5 * (0..3).map(|a| (hi[a] - lo[a]).powi(2)).sum::<f64>().sqrt();
        let found: Vec<(usize, u32, f64)> =
            among.iter().filter_map(|&n| self.look(n, middle).map(|(source, squared)| (n, source, squared))).collect();
        let Some(best) = found.iter().copied().reduce(|best, next| if next.2 < best.2 { next } else { best }) else {
            return;
        };
        if part.len() == 1 {
            return tell(part, self.labels[best.0], Some(best.1));
        }
        // A little more, for the roots are rounded.
        let limit = best.2.sqrt() * (1.0 + 1e-12) + 2.0 * reach * (1.0 + 1e-9);
        let left: Vec<usize> = found.iter().filter(|(_, _, squared)| squared.sqrt() <= limit).map(|f| f.0).collect();
        if left.len() == 1 {
            return tell(part, self.labels[left[0]], None);
        }
        for half in halves(part) {
            self.settle_among(geometry, &half, &left, tell);
        }
    }

    fn look(&self, tree: usize, here: [f64; 3]) -> Option<(u32, f64)> {
        match &self.trees[tree] {
            Tree::Points(tree) => tree.nearest_neighbor(here).map(|p| (p.data, p.distance_2(&here))),
            Tree::Triangles(tree) => tree.nearest_neighbor(here).map(|t| (t.data, t.distance_2(&here))),
        }
    }
}

/// The two halves of a box along its longest axis.
fn halves(part: &Box3) -> [Box3; 2] {
    let shape = part.shape();
    let axis = (0..3).rev().max_by_key(|&a| shape[a]).unwrap_or(0);
    let cut = part.lo[axis] + shape[axis] / 2;
    let (mut lower, mut upper) = (*part, *part);
    (lower.hi[axis], upper.lo[axis]) = (cut, cut);
    [lower, upper]
}
