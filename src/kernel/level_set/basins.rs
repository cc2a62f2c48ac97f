//! Basins inside one brick: connected voxels with `d > b`, the pieces of what a closed cloud encloses.
//!
//! A basin's `b` is the same on all its voxels: the saddle at which the cloud's hole lets the flood in. Its
//! persistence is `max d / b` (algorithms: section 5). Pieces of neighbouring bricks are joined by the caller.

/// The part of a basin that lies in one brick.
#[derive(Clone, Copy, Debug, PartialEq)]
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
