//! The surfaces between the labels of a volume in one brick, and to what has none, as one mesh: cells are cut into
//! tetrahedra and these by the labels of their corners (`tetrahedron`), as between labelled sources (`interfaces`).
//! Vertices lie where smoothed indicator functions say: of objects that were found (`indicators`), or of labels that were given, each voxel
//! of which keeps its own (`walls`).
//!
//! Every edge of the mesh has two facets, and three or more along the lines where three labels meet; label 0 counts as
//! one. So the facets of each label are a closed surface.

use super::cuts::{Cuts, Piece};
use super::indicators::{Indicators, RADIUS};
use super::polygon;
use super::sides::Sides;
use super::tetrahedron::{ORDERS, corner_of};
use crate::grid::Box3;
use crate::kernel::surface::mesh::growing::table_bytes;
use crate::kernel::surface::mesh::key_hash::KeyMap;
use crate::kernel::surface::mesh::patch::Patch;
use crate::kernel::surface::mesh::vertex_key::VertexKey;

/// How close to a voxel centre a vertex may come, in parts of the edge: triangles keep an area.
const MARGIN: f64 = 1.0 / 256.0;

/// How many voxels around the corners of cells are looked at.
pub const REACH: i64 = RADIUS;

/// No vertex was made there yet.
const NONE: u32 = u32::MAX;

/// Finds the surfaces brick by brick; keeps its working memory between bricks.
#[derive(Clone, Debug, Default)]
pub struct Partition<S = Indicators> {
    sides: S,
    cuts: Cuts,
    /// The vertex on each edge, by 7 * (place of its lower voxel) + (axes of its step as bits) - 1.
    on_edges: Vec<u32>,
    /// Those within three corners or four.
    within: KeyMap<VertexKey, u32>,
}

/// Some corners of a cell, in the order of all cells, with their labels.
#[derive(Clone, Copy)]
struct Within {
    voxels: [[i64; 3]; 4],
    labels: [u32; 4],
    len: usize,
}

/// A cell that is cut.
struct Cell {
    lowest: [i64; 3],
    part: Box3,
    /// Of its corners, given by the bits of their axes.
    labels: [u32; 8],
}

impl<S: Sides> Partition<S> {
    /// With sides told by somebody.
    #[must_use]
    pub fn new(sides: S) -> Self {
        Self { sides, cuts: Cuts::default(), on_edges: Vec::new(), within: KeyMap::default() }
    }

    /// Fills `patch` with the surfaces in `cells`, given by their lowest corners. `labels` is dense over `around`, which
    /// reaches as far around the corners of all cells as who tells the sides needs, [`REACH`] voxels for objects.
    pub fn extract(&mut self, labels: &[u32], around: &Box3, cells: &Box3, patch: &mut Patch) {
        *patch = Patch { cells: *cells, ..Patch::default() };
        let part = Box3::new(cells.lo, cells.hi.map(|v| v + 1));
        self.sides.enter(labels, around, &part);
        if self.sides.is_one() {
            return;
        }
        self.within.clear();
        self.on_edges.clear();
        self.on_edges.resize(7 * part.len(), NONE);
        let cuts = std::mem::take(&mut self.cuts);
        let corners: [usize; 8] = std::array::from_fn(|n| part.offset_of(corner_of(part.lo, n as u8)));
        for (y, z) in cells.rows() {
            let row = part.offset_of([cells.lo[0], y, z]);
            for (at, x) in (row..).zip(cells.lo[0]..cells.hi[0]) {
                let labels = corners.map(|corner| self.sides.label(at + corner));
                if labels.iter().any(|label| *label != labels[0]) {
                    self.cut(&cuts, &Cell { lowest: [x, y, z], part, labels }, patch);
                }
            }
        }
        self.cuts = cuts;
    }

    /// Bytes of memory that stay between bricks.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.sides.bytes() + table_bytes(&self.within) + (self.on_edges.capacity() * size_of::<u32>()) as u64
    }

    fn cut(&mut self, cuts: &Cuts, cell: &Cell, patch: &mut Patch) {
        for order in 0..ORDERS.len() {
            let corners = Cuts::corners(order);
            let labels = corners.map(|corner| cell.labels[usize::from(corner)]);
            for piece in cuts.of(order, labels) {
                self.facet(cell, corners, piece, patch);
            }
        }
    }

    /// Adds a polygon that separates the labels of two corners.
    fn facet(&mut self, cell: &Cell, corners: [u8; 4], piece: &Piece, patch: &mut Patch) {
        let [from, to] = piece.between.map(|n| cell.labels[usize::from(corners[n])]);
        let is_upward = piece.is_upward == (from < to);
        let mut ring = [NONE; 4];
        for (vertex, &set) in ring.iter_mut().zip(&piece.ring) {
            *vertex = self.vertex(cell, corners, set, patch);
        }
        for triangle in polygon::fan(piece.ring.len()) {
            let [a, b, c] = triangle.map(|n| ring[n]);
            patch.triangles.push(if is_upward { [a, b, c] } else { [a, c, b] });
            patch.pairs.push([from.min(to), from.max(to)]);
        }
    }

    /// The vertex within a set of a tetrahedron's corners, made when its first facet asks for it.
    fn vertex(&mut self, cell: &Cell, corners: [u8; 4], set: u8, patch: &mut Patch) -> u32 {
        let mut within = Within { voxels: [[0; 3]; 4], labels: [0; 4], len: 0 };
        // A way from the lowest corner to the highest takes its corners in the order of all cells.
        for n in (0..4).filter(|n| set >> n & 1 == 1) {
            within.voxels[within.len] = corner_of(cell.lowest, corners[n]);
            within.labels[within.len] = cell.labels[usize::from(corners[n])];
            within.len += 1;
        }
        let next = patch.keys.len() as u32;
        let key = || VertexKey::within(&within.voxels.map(|voxel| voxel.map(|v| 2 * v))[..within.len]);
        let (found, key) = if within.len == 2 {
            let [first, second] = [set.trailing_zeros(), set.ilog2()].map(|n| corners[n as usize]);
            let place = 7 * cell.part.offset_of(within.voxels[0]) + usize::from(first ^ second) - 1;
            if self.on_edges[place] != NONE {
                return self.on_edges[place];
            }
            self.on_edges[place] = next;
            (next, key())
        } else {
            let key = key();
            (*self.within.entry(key).or_insert(next), key)
        };
        if found == next {
            patch.keys.push(key);
            patch.positions.push(self.place(&within));
        }
        found
    }

    /// Where the labels of some corners meet: the middle of the places between each two.
    fn place(&self, within: &Within) -> [f64; 3] {
        let weights = self.weights(within);
        let place = std::array::from_fn(|a| (0..within.len).map(|n| weights[n] * within.voxels[n][a] as f64).sum());
        self.sides.ends().map_or(place, |ends| at_ends(ends, place, &within.voxels[..within.len]))
    }

    fn weights(&self, within: &Within) -> [f64; 4] {
        let Within { voxels, labels, len } = *within;
        let mut weights = [0.0; 4];
        let pairs = len * (len - 1) / 2;
        for m in 1..len {
            for n in 0..m {
                // Near an end where they do not meet between the two.
                let at = self.sides.between([voxels[n], voxels[m]], [labels[n], labels[m]]);
                let at = at.clamp(MARGIN, 1.0 - MARGIN);
                weights[n] += (1.0 - at) / pairs as f64;
                weights[m] += at / pairs as f64;
            }
        }
        weights
    }
}

/// Puts a vertex within some voxels where the volume ends between them.
fn at_ends(ends: &Box3, place: [f64; 3], voxels: &[[i64; 3]]) -> [f64; 3] {
    std::array::from_fn(|a| {
        if voxels.iter().any(|voxel| voxel[a] < ends.lo[a]) {
            ends.lo[a] as f64 - 0.5
        } else if voxels.iter().any(|voxel| voxel[a] >= ends.hi[a]) {
            ends.hi[a] as f64 - 0.5
        } else {
            place[a]
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// The areas between labels of a volume that `label` tells, which ends within a box of `edge` voxels.
    fn areas(edge: i64, label: impl Fn([f64; 3]) -> u32) -> Vec<([u32; 2], f64)> {
        let cells = Box3::from_shape([edge - 1; 3]);
        let around = Box3::from_shape([edge; 3]).grow(REACH);
        let voxels = around.rows().flat_map(|(y, z)| (around.lo[0]..around.hi[0]).map(move |x| [x, y, z]));
        let labels: Vec<u32> = voxels.map(|v| label(v.map(|v| v as f64))).collect();
        let mut patch = Patch::default();
        <Partition>::default().extract(&labels, &around, &cells, &mut patch);
        let mut found = std::collections::BTreeMap::new();
        for (triangle, pair) in patch.triangles.iter().zip(&patch.pairs) {
            let [a, b, c] = triangle.map(|v| DVec3::from(patch.positions[v as usize]));
            *found.entry(*pair).or_insert(0.0) += 0.5 * (b - a).cross(c - a).length();
        }
        found.into_iter().collect()
    }

    #[test]
    fn tilted_discs_and_the_ball_around_have_their_areas() {
        for normal in [
            [1.0, 0.0, 0.0],
            [0.6, 0.8, 0.0],
            [0.36, 0.48, 0.8],
            [0.2, 0.1, 0.97],
            [1.0, 1.0, 1.0],
            [1.0, -1.0, 0.0],
            [0.3, -0.5, 0.6],
        ] {
            let length = (0..3).map(|a: usize| normal[a] * normal[a]).sum::<f64>().sqrt();
            let height = |v: [f64; 3]| (0..3).map(|a| normal[a] / length * (v[a] - 15.7)).sum::<f64>();
            // Seen in a ball around the middle, of which the plane cuts a disc; outside of it is a third label.
            let inside = |v: [f64; 3]| (0..3).map(|a| (v[a] - 15.7).powi(2)).sum::<f64>() < 144.0;
            let found = areas(32, |v| if inside(v) { 1 + u32::from(height(v) > 0.0) } else { 0 });
            let [([0, 1], half), ([0, 2], other), ([1, 2], disc)] = found[..] else { panic!("{found:?}") };
            let (ball, expected) = (4.0 * std::f64::consts::PI * 144.0, std::f64::consts::PI * 144.0);
            assert!((disc / expected - 1.0).abs() < 0.015, "{disc} of {expected}");
            assert!(((half + other) / ball - 1.0).abs() < 0.015, "{half} and {other} of {ball}");
        }
    }
}
