//! How a cell's tetrahedra are cut, made ready for every way in which labels can be spread over four corners: what
//! `tetrahedron` tells of one is told here once and for all.

use super::corner::Corner;
use super::tetrahedron::{ORDERS, Tetrahedron, corner_of};

/// A piece of the surface in a tetrahedron: a polygon between two of its corners.
#[derive(Clone, Debug)]
pub(crate) struct Piece {
    /// The corners, as places in the tetrahedron.
    pub(crate) between: [usize; 2],
    /// Whether it runs counter-clockwise as seen from the second of them.
    pub(crate) is_upward: bool,
    /// The corners that each vertex lies within, as bits.
    pub(crate) ring: Vec<u8>,
}

/// The pieces of each tetrahedron of a cell by the pattern of its labels.
#[derive(Clone, Debug)]
pub(crate) struct Cuts {
    pieces: Vec<[Vec<Piece>; PATTERNS]>,
}

/// Ways of being equal or not, of four labels: by the first corner that has the label of each.
const PATTERNS: usize = 24;

impl Default for Cuts {
    fn default() -> Self {
        Self { pieces: ORDERS.iter().map(|order| std::array::from_fn(|pattern| pieces(*order, pattern))).collect() }
    }
}

impl Cuts {
    /// The corners of a tetrahedron in the cell, as bits for its axes.
    pub(crate) fn corners(order: usize) -> [u8; 4] {
        let second = 1 << ORDERS[order][0];
        [0, second, second | 1 << ORDERS[order][1], 7]
    }

    /// The pieces of a tetrahedron of which the corners have these labels.
    pub(crate) fn of(&self, order: usize, labels: [u32; 4]) -> &[Piece] {
        let first = |n: usize| (0..n).position(|m| labels[m] == labels[n]).unwrap_or(n);
        &self.pieces[order][first(1) + 2 * first(2) + 6 * first(3)]
    }
}

fn pieces(order: [usize; 3], pattern: usize) -> Vec<Piece> {
    // Each corner's label is the number of the first one that has it; patterns that name none are never asked for.
    let labels = [0, pattern % 2, pattern / 2 % 3, pattern / 6];
    let second = 1 << order[0];
    let corners = [0, second, second | 1 << order[1], 7_u8];
    let corner = |n: usize| {
        let voxel = corner_of([0; 3], corners[n]);
        Corner { halves: voxel.map(|v| 2 * v), place: voxel.map(|v| v as f64), label: labels[n] as u32 }
    };
    let tetrahedron = Tetrahedron { corners: [0, 1, 2, 3].map(corner) };
    let mut found = Vec::new();
    tetrahedron.pieces(|sets, ring| {
        let [low, high] = tetrahedron.pair(sets);
        let is_upward = tetrahedron.is_upward(sets, ring) == (low < high);
        let between = sets.map(|set| set.trailing_zeros() as usize);
        found.push(Piece { between, is_upward, ring: ring.to_vec() });
    });
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_are_those_of_the_tetrahedron_itself() {
        let cuts = Cuts::default();
        for code in 0..256_usize {
            // Labels in any order, equal or not.
            let labels = [0, 1, 2, 3].map(|n| [7, 2, 9, 4][code >> (2 * n) & 3]);
            for (n, order) in ORDERS.iter().enumerate() {
                assert_eq!(Cuts::corners(n)[2].count_ones(), 2, "{order:?}");
                let corners = [0, 1, 2, 3].map(|m| {
                    let voxel = corner_of([5, 3, 8], Cuts::corners(n)[m]);
                    Corner { halves: voxel.map(|v| 2 * v), place: voxel.map(|v| v as f64), label: labels[m] }
                });
                let tetrahedron = Tetrahedron { corners };
                let mut pieces = cuts.of(n, labels).iter();
                tetrahedron.pieces(|sets, ring| {
                    let piece = pieces.next().unwrap();
                    let pair = piece.between.map(|corner| labels[corner]);
                    assert_eq!((pair, piece.ring.as_slice()), (tetrahedron.pair(sets), ring));
                    assert_eq!(piece.is_upward == (pair[0] < pair[1]), tetrahedron.is_upward(sets, ring));
                });
                assert!(pieces.next().is_none());
            }
        }
    }
}
