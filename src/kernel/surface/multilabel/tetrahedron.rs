//! A cell's tetrahedra and the pieces of the surface in one of them, told from the labels of its corners alone
//! (marching tetrahedra for many materials, after Bloomenthal & Ferguson 1995).
//!
//! A piece is a polygon between two labels. Its vertices lie within sets of corners, written as bits: on an edge between
//! two labels, in a triangle of three, in the tetrahedron of four. Where they lie there, others say.

use glam::DVec3;

use super::corner::Corner;
use crate::kernel::surface::mesh::vertex_key::VertexKey;

/// Orders in which a way along a cell's edges can take the axes; each is a tetrahedron.
pub(crate) const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

/// A tetrahedron of a cell.
#[derive(Clone, Copy)]
pub(crate) struct Tetrahedron {
    pub(crate) corners: [Corner; 4],
}

impl Tetrahedron {
    /// Calls `face` with each piece: two sets of one corner each, of the labels that it separates, and its polygon.
    pub(crate) fn pieces(&self, mut face: impl FnMut([u8; 2], &[u8])) {
        let labels = self.corners.map(|corner| corner.label);
        let like = |n: usize| (0..4).filter(|&m| labels[m] == labels[n]).fold(0_u8, |set, m| set | 1 << m);
        let mut kinds: Vec<u8> = (0..4).map(like).collect();
        kinds.sort_unstable_by_key(|set| (std::cmp::Reverse(set.count_ones()), *set));
        kinds.dedup();
        let members = |set: u8| (0..4).filter(move |n| set >> n & 1 == 1).map(|n| 1_u8 << n);
        match *kinds.as_slice() {
            [_] => {}
            [many, one] if one.is_power_of_two() => {
                let [a, b, c] = three(members(many));
                face([a, one], &[a | one, b | one, c | one]);
            }
            [pair, other] => {
                let ([a, b, _], [c, d, _]) = (three(members(pair)), three(members(other)));
                face([a, c], &[a | c, b | c, b | d, a | d]);
            }
            [pair, c, d] => {
                let [a, b, _] = three(members(pair));
                face([c, d], &[c | d, a | c | d, b | c | d]);
                for single in [c, d] {
                    face([a, single], &[a | single, b | single, b | c | d, a | c | d]);
                }
            }
            _ => {
                for (n, m) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
                    let edge = 1_u8 << n | 1 << m;
                    let [k, l, _] = three(members(0b1111 & !edge));
                    face([1 << n, 1 << m], &[edge, edge | k, 0b1111, edge | l]);
                }
            }
        }
    }

    /// The labels of two corners, each given as a set of it alone.
    pub(crate) fn pair(&self, corners: [u8; 2]) -> [u32; 2] {
        corners.map(|set| self.corners[set.trailing_zeros() as usize].label)
    }

    /// Whether a polygon between the labels of two corners runs counter-clockwise as seen from the larger label.
    pub(crate) fn is_upward(&self, corners: [u8; 2], polygon: &[u8]) -> bool {
        let [from, to] = corners;
        let [low, high] = self.pair(corners);
        // Which way round is told from the middles of what vertices lie within, which never fall together.
        let [a, b, c] = [0, 1, 2].map(|n| self.middle(polygon[n]));
        let along = self.middle(to) - self.middle(from);
        ((b - a).cross(c - a).dot(along) > 0.0) == (low < high)
    }

    /// The middle of some of its corners, voxel units.
    fn middle(&self, set: u8) -> DVec3 {
        let corners = self.corners.iter().enumerate().filter(|(n, _)| set >> n & 1 == 1);
        corners.map(|(_, corner)| DVec3::from(corner.place)).sum::<DVec3>() / f64::from(set.count_ones())
    }

    /// Some of its corners in the order of all cells, how many they are, and the key of the vertex within them.
    pub(crate) fn sorted(&self, set: u8) -> ([Corner; 4], usize, VertexKey) {
        let mut corners = self.corners;
        let mut len = 0;
        for n in (0..4).filter(|n| set >> n & 1 == 1) {
            corners[len] = self.corners[n];
            len += 1;
        }
        corners[..len].sort_unstable_by_key(Corner::order);
        let halves = corners.map(|corner| corner.halves);
        (corners, len, VertexKey::within(&halves[..len]))
    }
}

/// The corner of a cell whose axes are given as bits.
pub(crate) fn corner_of(cell: [i64; 3], corner: u8) -> [i64; 3] {
    std::array::from_fn(|a| cell[a] + i64::from(corner >> a & 1))
}

/// The first three of some sets; 0 where there are fewer.
fn three(sets: impl Iterator<Item = u8>) -> [u8; 3] {
    let mut found = [0; 3];
    found.iter_mut().zip(sets).for_each(|(place, set)| *place = set);
    found
}
