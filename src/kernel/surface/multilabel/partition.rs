//! The surfaces between the labels of a volume in one brick, and to what has none, as one mesh: cells are cut into
//! tetrahedra and these by the labels of their corners (`tetrahedron`), as between labelled sources (`interfaces`).
//! Vertices lie where smoothed indicator functions say (`indicators`).
//!
//! Every edge of the mesh has two facets, and three or more along the lines where three labels meet; label 0 counts as
//! one. So the facets of each label are a closed surface.

use std::collections::HashMap;

use super::corner::Corner;
use super::indicators::{Indicators, RADIUS};
use super::polygon;
use super::tetrahedron::{ORDERS, Tetrahedron, corner_of};
use crate::grid::Box3;
use crate::kernel::surface::mesh::growing::table_bytes;
use crate::kernel::surface::mesh::patch::Patch;
use crate::kernel::surface::mesh::vertex_key::VertexKey;

/// How close to a voxel centre a vertex may come, in parts of the edge: triangles keep an area.
const MARGIN: f64 = 1.0 / 256.0;

/// How many voxels around the corners of cells are looked at.
pub const REACH: i64 = RADIUS;

/// Finds the surfaces brick by brick; keeps its working memory between bricks.
#[derive(Clone, Debug, Default)]
pub struct Partition {
    indicators: Indicators,
    vertices: HashMap<VertexKey, u32>,
}

impl Partition {
    /// Fills `patch` with the surfaces in `cells`, given by their lowest corners. `labels` is dense over `around`, which
    /// reaches [`REACH`] voxels around the corners of all cells.
    pub fn extract(&mut self, labels: &[u32], around: &Box3, cells: &Box3, patch: &mut Patch) {
        *patch = Patch { cells: *cells, ..Patch::default() };
        self.vertices.clear();
        let part = Box3::new(cells.lo, cells.hi.map(|v| v + 1));
        self.indicators.enter(labels, around, &part);
        if self.indicators.is_one() {
            return;
        }
        for (y, z) in cells.rows() {
            for x in cells.lo[0]..cells.hi[0] {
                self.cut_cell(&part, [x, y, z], patch);
            }
        }
    }

    /// Bytes of memory that stay between bricks.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        self.indicators.bytes() + table_bytes(&self.vertices)
    }

    fn cut_cell(&mut self, part: &Box3, cell: [i64; 3], patch: &mut Patch) {
        let label = |n: u8| self.indicators.label(part.offset_of(corner_of(cell, n)));
        let first = label(0);
        if (1..8).all(|n| label(n) == first) {
            return;
        }
        let voxels: [Corner; 8] = std::array::from_fn(|n| {
            let voxel = corner_of(cell, n as u8);
            Corner { halves: voxel.map(|v| 2 * v), place: voxel.map(|v| v as f64), label: label(n as u8) }
        });
        for order in ORDERS {
            let second = 1 << order[0];
            let corners = [0, second, second | 1 << order[1], 7].map(|n: usize| voxels[n]);
            let tetrahedron = Tetrahedron { corners };
            tetrahedron.pieces(|corners, polygon| self.facet(part, &tetrahedron, corners, polygon, patch));
        }
    }

    /// Adds a polygon that separates the labels of two corners.
    fn facet(&mut self, part: &Box3, tetrahedron: &Tetrahedron, corners: [u8; 2], sets: &[u8], patch: &mut Patch) {
        let [from, to] = tetrahedron.pair(corners);
        let is_upward = tetrahedron.is_upward(corners, sets);
        let ring: Vec<u32> = sets.iter().map(|&set| self.vertex(part, tetrahedron, set, patch)).collect();
        for triangle in polygon::fan(ring.len()) {
            let [a, b, c] = triangle.map(|n| ring[n]);
            patch.triangles.push(if is_upward { [a, b, c] } else { [a, c, b] });
            patch.pairs.push([from.min(to), from.max(to)]);
        }
    }

    /// The vertex within a set of the tetrahedron's corners, made when its first facet asks for it.
    fn vertex(&mut self, part: &Box3, tetrahedron: &Tetrahedron, set: u8, patch: &mut Patch) -> u32 {
        let (corners, len, key) = tetrahedron.sorted(set);
        let indicators = &self.indicators;
        *self.vertices.entry(key).or_insert_with(|| {
            let weights = weights(indicators, part, &corners[..len]);
            let place = |a: usize| corners.iter().zip(&weights).map(|(corner, w)| w * corner.place[a]).sum();
            patch.keys.push(key);
            patch.positions.push(std::array::from_fn(place));
            patch.keys.len() as u32 - 1
        })
    }
}

/// The weights of corners of different labels at the place between these: the middle of the places between each two.
fn weights(indicators: &Indicators, part: &Box3, corners: &[Corner]) -> Vec<f64> {
    let mut weights = vec![0.0; corners.len()];
    let pairs = corners.len() * (corners.len() - 1) / 2;
    for m in 1..corners.len() {
        for n in 0..m {
            let at = on_edge(indicators, part, [corners[n], corners[m]]);
            weights[n] += (1.0 - at) / pairs as f64;
            weights[m] += at / pairs as f64;
        }
    }
    weights
}

/// How far along an edge the labels of its ends are equal; near an end where they are not between the two.
fn on_edge(indicators: &Indicators, part: &Box3, ends: [Corner; 2]) -> f64 {
    let [from, to] = ends.map(|corner| indicators.lead(place(part, &corner), ends[0].label, ends[1].label));
    let at = if from > to { from / (from - to) } else { 0.5 };
    at.clamp(MARGIN, 1.0 - MARGIN)
}

fn place(part: &Box3, corner: &Corner) -> usize {
    part.offset_of(corner.halves.map(|v| v / 2))
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
        Partition::default().extract(&labels, &around, &cells, &mut patch);
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
