//! The bottleneck flood on one tile (docs/algorithms.md, "Bottleneck flood").
//!
//! `b_p` is the largest threshold at which a flood from the domain's border through voxels with `d >= threshold` still
//! reaches p: the fixed point of `b_p = max(b_p, min(d_p, max over face neighbours b_q))`. Only comparisons, so the
//! fixed point is reached exactly, in any order, for any bricks. Voxels with `d > b` lie in basins.

use crate::tile::HaloTile;

/// Relaxes the tile until nothing rises. `d` is dense over the brick; ghosts of `b` are current. Returns whether
/// anything rose.
pub fn relax(b: &mut HaloTile<f32>, d: &[f32]) -> bool {
    let mut rose = false;
    loop {
        let forward = pass(b, d, true);
        let backward = forward && pass(b, d, false);
        rose |= forward;
        if !backward {
            return rose;
        }
    }
}

/// Sets 1 where the flood at a threshold does not reach, 0 elsewhere.
pub fn beyond(level: &[f32], threshold: f32, inside: &mut [u8]) {
    for (inside, &level) in inside.iter_mut().zip(level) {
        *inside = u8::from(level < threshold);
    }
}

/// The highest level of a layer of voxels, 0 at least: what a region beside it is flooded with.
#[must_use]
pub fn highest(layer: &[f32]) -> f32 {
    layer.iter().copied().fold(0.0, f32::max)
}

/// The voxels that a flood at a threshold reaches and beside which it does not reach one; x fastest.
#[must_use]
pub fn shore(b: &HaloTile<f32>, threshold: f32) -> Vec<[usize; 3]> {
    let (pitch, valid) = (b.pitch(), b.valid());
    let mut found = Vec::new();
    for (z, y) in (0..valid[2]).flat_map(|z| (0..valid[1]).map(move |y| (z, y))) {
        let start = b.at(0, y as isize, z as isize);
        for x in 0..valid[0] {
            let at = start + x;
            let beside = [at - 1, at + 1, at - pitch, at + pitch, at - pitch * pitch, at + pitch * pitch];
            if b.data()[at] >= threshold && beside.iter().any(|&next| b.data()[next] < threshold) {
                found.push([x, y, z]);
            }
        }
    }
    found
}

fn pass(b: &mut HaloTile<f32>, d: &[f32], upward: bool) -> bool {
    let (edge, pitch, valid) = (b.edge(), b.pitch(), b.valid());
    let mut rose = false;
    let rows = valid[1] * valid[2];
    for n in 0..rows {
        let row = if upward { n } else { rows - 1 - n };
        let (y, z) = (row % valid[1], row / valid[1]);
        let start = b.at(0, y as isize, z as isize);
        let limits = &d[(z * edge + y) * edge..][..valid[0]];
        let b = b.data_mut();
        for m in 0..valid[0] {
            let x = if upward { m } else { valid[0] - 1 - m };
            let at = start + x;
            if b[at] >= limits[x] {
                continue;
            }
            let along = b[at - 1].max(b[at + 1]);
            let across = b[at - pitch].max(b[at + pitch]).max(b[at - pitch * pitch]).max(b[at + pitch * pitch]);
            let reached = limits[x].min(along.max(across));
            if reached > b[at] {
                b[at] = reached;
                rose = true;
            }
        }
    }
    rose
}
