//! Which basins persist (docs/algorithms.md, "Bottleneck flood"): the pieces of all bricks, joined where they touch,
//! their depths compared with their saddles. Depths and saddles are only compared, so names and sums do not depend on
//! the order in which pieces are joined.

use super::basins::Piece;
use crate::kernel::topology::union_find::Forest;

/// A basin persists when its depth is at least this many times its saddle; noise stays below 1.5.
pub const PERSISTENCE: f32 = 2.0;

/// Bytes that a piece takes until it is known which basins persist: itself, twice while it is added up, its place among trees and
/// roots, its basin.
pub const PIECE_BYTES: u64 = 128;

/// The pieces that touch across a face between two bricks, each two once: `labels` of the voxels on its two sides, in the same order, 0 for
/// none; `first` are the pieces that label 1 stands for on each side.
pub fn across(labels: [&[u16]; 2], first: [u32; 2], touching: &mut Vec<[u32; 2]>) {
    let both = labels[0].iter().zip(labels[1]).filter(|(a, b)| **a != 0 && **b != 0);
    add(both.map(|(&a, &b)| [first[0] + u32::from(a) - 1, first[1] + u32::from(b) - 1]), touching);
}

/// Everything labelled on a face touches the one piece that lies beyond all of it.
pub fn beyond(labels: &[u16], first: u32, piece: u32, touching: &mut Vec<[u32; 2]>) {
    add(labels.iter().filter(|label| **label != 0).map(|&label| [first + u32::from(label) - 1, piece]), touching);
}

/// Few pieces touch across one face: what is known of it is looked through from its end.
fn add(pairs: impl Iterator<Item = [u32; 2]>, touching: &mut Vec<[u32; 2]>) {
    let begun = touching.len();
    for pair in pairs {
        if !touching[begun..].iter().rev().any(|known| *known == pair) {
            touching.push(pair);
        }
    }
}

/// Pieces that are being joined.
#[derive(Clone, Debug)]
pub struct Joins {
    pieces: Vec<Piece>,
    forest: Forest,
}

impl Joins {
    /// Pieces of which none touch yet; they are numbered in this order.
    #[must_use]
    pub fn new(pieces: Vec<Piece>) -> Self {
        let forest = Forest::of_singles(pieces.len());
        Self { pieces, forest }
    }

    /// Joins two pieces that touch.
    pub fn join(&mut self, [a, b]: [u32; 2]) {
        self.forest.join(a, b);
    }

    /// Adds up what was joined and keeps the basins so many times as deep as their saddle, in order of their roots;
    /// tells for each piece which of them it is part of.
    #[must_use]
    pub fn persisting(mut self, ratio: f32) -> (Vec<Piece>, Vec<Option<u32>>) {
        let roots = self.forest.roots();
        let mut whole = self.pieces.clone();
        for (n, &root) in roots.iter().enumerate().filter(|(n, root)| *n as u32 != **root) {
            let sum = &mut whole[root as usize];
            sum.voxels += self.pieces[n].voxels;
            sum.depth = sum.depth.max(self.pieces[n].depth);
        }
        let (mut basins, mut names) = (Vec::new(), vec![None; whole.len()]);
        for (n, piece) in whole.iter().enumerate().filter(|(n, _)| roots[*n] == *n as u32) {
            if piece.depth > 0.0 && piece.depth >= ratio * piece.saddle {
                names[n] = Some(basins.len() as u32);
                basins.push(*piece);
            }
        }
        (basins, roots.iter().map(|&root| names[root as usize]).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn piece(voxels: u64, depth: f32, saddle: f32) -> Piece {
        Piece { voxels, depth, saddle }
    }

    #[test]
    fn what_touches_is_one_basin() {
        // Two bricks with two pieces each, and a far region beyond the second brick.
        let pieces =
            vec![piece(5, 1.5, 1.0), piece(7, 1.0, 0.9), piece(1, 1.2, 0.9), piece(2, 1.9, 1.0), piece(64, 2.5, 1.0)];
        let (mut joins, mut touching) = (Joins::new(pieces), Vec::new());
        across([&[0, 1, 2, 1, 1], &[1, 2, 1, 0, 2]], [0, 2], &mut touching);
        beyond(&[0, 0, 2, 2], 2, 4, &mut touching);
        assert_eq!(touching, [[0, 3], [1, 2], [3, 4]], "each two once");
        for pair in touching {
            joins.join(pair);
        }
        let (basins, names) = joins.persisting(PERSISTENCE);
        assert_eq!(basins, [piece(71, 2.5, 1.0)], "1.2 over 0.9 is noise");
        assert_eq!(names, [Some(0), None, None, Some(0), Some(0)]);
    }

    #[test]
    fn depth_twice_the_saddle_persists_and_no_depth_never_does() {
        let joins = Joins::new(vec![piece(1, 1.99, 1.0), piece(1, 2.0, 1.0), piece(9, 0.0, 0.0), piece(1, 1.0, 0.0)]);
        let (basins, names) = joins.persisting(PERSISTENCE);
        assert_eq!(basins, [piece(1, 2.0, 1.0), piece(1, 1.0, 0.0)]);
        assert_eq!(names, [None, Some(0), None, Some(1)]);
    }
}
