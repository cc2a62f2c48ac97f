//! Basins inside one brick: connected voxels with `d > b`, the pieces of what a closed cloud encloses, and where the
//! flood enters them.
//!
//! A basin's `b` is the same on all its voxels: the saddle at which the cloud's hole lets the flood in. Its persistence
//! is `max d / b` (docs/algorithms.md, "Bottleneck flood"). Pieces of neighbouring bricks are joined in `persistence`.

use serde::{Deserialize, Serialize};

use crate::grid::{FACES, Face};
use crate::tile::HaloTile;

/// The part of a basin that lies in one brick.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Piece {
    /// Number of voxels.
    pub voxels: u64,
    /// The largest distance to the cloud in it.
    pub depth: f32,
    /// The threshold below which the flood enters.
    pub saddle: f32,
}

/// Labels the connected voxels (six neighbours) with `d > b`, from 1 on, 0 elsewhere; returns the pieces by label.
///
/// All arrays are dense with row length and plane height `edge`; `valid` voxels along each axis count.
pub fn label(d: &[f32], b: &[f32], edge: usize, valid: [usize; 3], labels: &mut [u16]) -> Vec<Piece> {
    labels.fill(0);
    let mut pieces = Vec::new();
    let mut stack = Vec::new();
    let mut visit = |seed: usize, labels: &mut [u16]| {
        let mut piece = Piece { voxels: 0, depth: 0.0, saddle: b[seed] };
        let name = pieces.len() as u16 + 1;
        labels[seed] = name;
        stack.push(seed);
        while let Some(at) = stack.pop() {
            piece.voxels += 1;
            piece.depth = piece.depth.max(d[at]);
            let place = [at % edge, at / edge % edge, at / (edge * edge)];
            for (axis, stride) in [1, edge, edge * edge].into_iter().enumerate() {
                let down = (place[axis] > 0).then(|| at - stride);
                let up = (place[axis] + 1 < valid[axis]).then(|| at + stride);
                for next in [down, up].into_iter().flatten() {
                    if d[next] > b[next] && labels[next] == 0 {
                        labels[next] = name;
                        stack.push(next);
                    }
                }
            }
        }
        pieces.push(piece);
    };
    for z in 0..valid[2] {
        for y in 0..valid[1] {
            for at in (z * edge + y) * edge..(z * edge + y) * edge + valid[0] {
                if d[at] > b[at] && labels[at] == 0 {
                    visit(at, labels);
                }
            }
        }
    }
    pieces
}

/// The voxels of one brick through which the flood may enter a basin: those that have the saddle's value both in d and
/// in b and a face neighbour in the basin; with the basin's number, x fastest, a voxel once for each such neighbour.
///
/// `d` and `b` are dense over the brick, `labels` has one ghost layer; `saddles` by basin. `basin` tells which one a
/// neighbour's label is part of, across the given face where the neighbour lies in another brick.
pub fn entries(
    labels: &HaloTile<u16>,
    d: &[f32],
    b: &[f32],
    saddles: &[f32],
    basin: impl Fn(Option<Face>, u16) -> Option<u32>,
) -> Vec<(u32, [usize; 3])> {
    let (edge, valid) = (labels.edge(), labels.valid());
    let mut found = Vec::new();
    for (z, y) in (0..valid[2]).flat_map(|z| (0..valid[1]).map(move |y| (z, y))) {
        for x in 0..valid[0] {
            let at = (z * edge + y) * edge + x;
            let value = d[at];
            if value != b[at] || !saddles.contains(&value) {
                continue;
            }
            for face in FACES {
                let beside: [isize; 3] = std::array::from_fn(|a| [x, y, z][a] as isize + face.offset()[a] as isize);
                let label = labels.data()[labels.at(beside[0], beside[1], beside[2])];
                let inside = (0..3).all(|a| (0..valid[a] as isize).contains(&beside[a]));
                let beyond = (!inside).then_some(face);
                if let Some(name) = basin(beyond, label).filter(|&name| saddles[name as usize] == value) {
                    found.push((name, [x, y, z]));
                }
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One row of four voxels in a brick of edge 4: wall, basin, saddle, outside; and a basin above the saddle's brick.
    #[test]
    fn pieces_and_their_entries_in_a_row() {
        let (mut d, mut b) = ([0.0; 64], [0.0; 64]);
        d[..4].copy_from_slice(&[0.5, 2.0, 1.0, 3.0]);
        b[..4].copy_from_slice(&[0.5, 1.0, 1.0, 3.0]);
        let (valid, mut labels) = ([4, 1, 1], [7; 64]);
        let pieces = label(&d, &b, 4, valid, &mut labels);
        assert_eq!(pieces, [Piece { voxels: 1, depth: 2.0, saddle: 1.0 }]);
        assert!((0..64).all(|n| labels[n] == u16::from(n == 1)), "{labels:?}");
        let mut tile = HaloTile::new(4);
        tile.set_valid(valid);
        let (here, above) = (tile.at(1, 0, 0), tile.at(2, 0, 1));
        tile.data_mut()[here] = 1;
        tile.data_mut()[above] = 5;
        let basin = |face: Option<Face>, label: u16| match (face, label) {
            (None, 1) => Some(0),
            (Some(face), 5) if face.axis == 2 && face.upper => Some(1),
            (_, 0) => None,
            other => panic!("no such neighbour: {other:?}"),
        };
        let voxel = [2, 0, 0];
        assert_eq!(entries(&tile, &d, &b, &[1.0, 1.0], basin), [(0, voxel), (1, voxel)]);
        assert_eq!(entries(&tile, &d, &b, &[1.0, 0.9], basin), [(0, voxel)], "another saddle's value");
    }
}
