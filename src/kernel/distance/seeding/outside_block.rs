//! The nearest of many sources for all voxels of a small block at a time (docs/algorithms.md, "Outside of the grid").
//!
//! Each voxel comes with what it holds already, which is hardly farther than the nearest source of all. An R-tree is
//! descended once for the whole block, into those nodes that may have a source as near to one of its voxels as what that
//! holds: a few, for the boxes around nodes are compared with each voxel's own distance. Differences to sources and
//! gaps to boxes are made once for each axis, and summed as distances of single voxels are: to the same bits, f64.

use rstar::primitives::GeomWithData;
use rstar::{AABB, ParentNode, RTree, RTreeNode, RTreeObject};

use crate::grid::{Box3, Geometry, NO_SOURCE};
use crate::kernel::distance::features::source_trees::Placed;
use crate::kernel::distance::state::source::counts_before;

/// Voxels of a block along each axis.
const EDGE: usize = 4;
/// Voxels of a block.
const LEN: usize = EDGE * EDGE * EDGE;
/// What rounding hides of a distance to a triangle or a box.
const ROUNDING: f64 = 1.0 + 1e-12;

/// The blocks that make up a box, cut from its lower corner on.
pub(crate) fn blocks(part: &Box3) -> impl Iterator<Item = Box3> {
    let (part, edge) = (*part, EDGE as i64);
    let counts = part.shape().map(|n| (n + edge - 1) / edge);
    Box3::from_shape(counts).rows().flat_map(move |(y, z)| {
        (0..counts[0]).map(move |x| {
            let lo = std::array::from_fn(|a| part.lo[a] + edge * [x, y, z][a]);
            Box3::new(lo, lo.map(|v| v + edge)).intersect(&part)
        })
    })
}

/// A block and the nearest known source of each of its voxels, `[z][y][x]` with room for [`EDGE`] voxels along each axis.
pub(crate) struct Block {
    voxels: Box3,
    /// Coordinates of the voxels along each axis.
    at: [[f64; EDGE]; 3],
    squared: [f64; LEN],
    source: [u32; LEN],
    /// The squared distance within which a source may count, rounding included; below zero where none can.
    within: [f64; LEN],
    /// The largest of these.
    most: f64,
    changed: [bool; LEN],
}

/// A source in a tree.
pub(crate) trait Source: RTreeObject<Envelope = AABB<[f64; 3]>> {
    /// Its number.
    fn number(&self) -> u32;

    /// The squared distances of a block's voxels, or what is out of reach of theirs.
    fn squared(&self, block: &Block) -> [f64; LEN];
}

impl Source for GeomWithData<[f64; 3], u32> {
    fn number(&self) -> u32 {
        self.data
    }

    #[inline(always)]
    fn squared(&self, block: &Block) -> [f64; LEN] {
        let point = self.geom();
        sums(std::array::from_fn(|a| block.at[a].map(|at| (at - point[a]) * (at - point[a]))))
    }
}

impl Source for GeomWithData<Placed, u32> {
    fn number(&self) -> u32 {
        self.data
    }

    #[inline(always)]
    fn squared(&self, block: &Block) -> [f64; LEN] {
        let mut squared = block.gaps(&self.envelope());
        for (n, squared) in squared.iter_mut().enumerate() {
            *squared = if *squared <= block.within[n] {
                self.geom().triangle.distance_squared(block.position(n))
            } else {
                f64::INFINITY
            };
        }
        squared
    }
}

/// Sums of one number of each axis for each voxel of a block.
#[inline(always)]
fn sums([x, y, z]: [[f64; EDGE]; 3]) -> [f64; LEN] {
    let mut sums = [0.0; LEN];
    for (n, row) in sums.chunks_exact_mut(EDGE).enumerate() {
        for (sum, x) in row.iter_mut().zip(x) {
            *sum = x + y[n % EDGE] + z[n / EDGE];
        }
    }
    sums
}

impl Block {
    /// A block of which `held` tells the squared distance and source that a voxel has, none where no source can be
    /// nearer.
    pub(crate) fn new(geometry: &Geometry, voxels: &Box3, held: impl Fn([i64; 3]) -> Option<(f64, u32)>) -> Self {
        let at = std::array::from_fn(|a| std::array::from_fn(|n| geometry.position([voxels.lo[a] + n as i64; 3])[a]));
        let mut block = Self {
            voxels: *voxels,
            at,
            squared: [f64::INFINITY; LEN],
            source: [NO_SOURCE; LEN],
            within: [-1.0; LEN],
            most: -1.0,
            changed: [false; LEN],
        };
        for n in 0..LEN {
            let voxel = block.voxel(n);
            if let Some(held) = voxels.contains(voxel).then(|| held(voxel)).flatten() {
                (block.squared[n], block.source[n]) = held;
                block.within[n] = held.0 * ROUNDING;
            }
        }
        block
    }

    fn voxel(&self, n: usize) -> [i64; 3] {
        let [x, y, z] = [n % EDGE, n / EDGE % EDGE, n / (EDGE * EDGE)].map(|n| n as i64);
        [self.voxels.lo[0] + x, self.voxels.lo[1] + y, self.voxels.lo[2] + z]
    }

    fn position(&self, n: usize) -> [f64; 3] {
        [self.at[0][n % EDGE], self.at[1][n / EDGE % EDGE], self.at[2][n / (EDGE * EDGE)]]
    }

    /// The squared distances of the voxels to a box.
    #[inline(always)]
    fn gaps(&self, around: &AABB<[f64; 3]>) -> [f64; LEN] {
        let (lower, upper) = (around.lower(), around.upper());
        sums(std::array::from_fn(|a| {
            self.at[a].map(|at| {
                let gap = (lower[a] - at).max(at - upper[a]).max(0.0);
                gap * gap
            })
        }))
    }

    /// Whether something in a box may count for a voxel.
    #[inline(always)]
    fn may_reach(&self, around: &AABB<[f64; 3]>) -> bool {
        // The whole block first: most boxes are far from all of it.
        let (lower, upper) = (around.lower(), around.upper());
        let gap = |a: usize| (lower[a] - self.at[a][EDGE - 1]).max(self.at[a][0] - upper[a]).max(0.0);
        if (0..3).map(|a| gap(a) * gap(a)).sum::<f64>() > self.most {
            return false;
        }
        let gaps = self.gaps(around);
        let near = gaps.iter().zip(&self.within).map(|(gap, within)| u32::from(gap <= within));
        near.fold(0, |any, near| any | near) != 0
    }

    /// Looks a tree's sources up, none farther than `farthest`. Each source has a label.
    pub(crate) fn search<T: Source>(&mut self, tree: &RTree<T>, farthest: f64, label: impl Fn(u32) -> u32) {
        if self.within.iter().all(|within| *within < 0.0) {
            return;
        }
        for within in &mut self.within {
            *within = within.min(farthest * farthest * ROUNDING);
        }
        pulp::Arch::new().dispatch(Descent { block: self, tree, label });
    }

    #[inline(always)]
    fn measure(&mut self) {
        self.most = self.within.iter().fold(-1.0, |most: f64, within| most.max(*within)) * ROUNDING;
    }

    /// Takes a source where it counts.
    #[inline(always)]
    fn offer<T: Source>(&mut self, source: &T, label: &impl Fn(u32) -> u32) {
        let squared = source.squared(self);
        let near = squared.iter().zip(&self.within).map(|(squared, within)| u32::from(squared <= within));
        if near.fold(0, |any, near| any | near) == 0 {
            return;
        }
        for n in 0..LEN {
            let (found, held) = ((squared[n], source.number()), (self.squared[n], self.source[n]));
            if found.0 <= self.within[n] && counts_before(found, held, label) {
                (self.squared[n], self.source[n]) = found;
                self.within[n] = found.0 * ROUNDING;
                self.changed[n] = true;
            }
        }
        self.measure();
    }

    /// Hands on the voxels that have another source now, each with its squared distance.
    pub(crate) fn each_nearer(&self, mut then: impl FnMut([i64; 3], (f64, u32))) {
        for n in (0..LEN).filter(|&n| self.changed[n]) {
            then(self.voxel(n), (self.squared[n], self.source[n]));
        }
    }
}

/// The way down a tree, compiled for each vector unit.
struct Descent<'a, T: Source, L> {
    block: &'a mut Block,
    tree: &'a RTree<T>,
    label: L,
}

impl<T: Source, L: Fn(u32) -> u32> pulp::NullaryFnOnce for Descent<'_, T, L> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { block, tree, label } = self;
        block.measure();
        let mut open: Vec<&ParentNode<T>> = vec![tree.root()];
        while let Some(node) = open.pop() {
            for child in node.children() {
                match child {
                    RTreeNode::Parent(node) if block.may_reach(&node.envelope()) => open.push(node),
                    RTreeNode::Leaf(source) => block.offer(source, &label),
                    RTreeNode::Parent(_) => {}
                }
            }
        }
    }
}
