//! FSM, the fast sweeping method for `|grad d| = 1` (Zhao 2005; Kósa & Mikula 2023, Alg. 2; algorithms: section 3).
//!
//! Godunov update: with `a_s` the smaller neighbour along axis s, the new value is the x with
//! `sum (((x - a_s)^+) / h_s)^2 = 1`, taken with one, two, then three axes in order of a. It is kept only when it
//! lowers the value. Storage f32, arithmetic f64. In and out: a grown tile of distances (physical units, infinity where nothing is
//! known); fixed voxels carry the sign bit and are never changed. Halo 1, faces. One sweep is one ordered pass;
//! tiles taken in sweep order give bit for bit what the triple loop over the whole domain gives.

use super::ordered;
use crate::tile::HaloTile;

/// Marks a voxel as fixed: the sign bit says so, the magnitude is the distance.
#[inline]
#[must_use]
pub fn fixed(distance: f32) -> f32 {
    -distance.abs()
}

/// True when the voxel's value is fixed (`-0.0` is a fixed zero).
#[inline]
#[must_use]
pub fn is_fixed(value: f32) -> bool {
    value.is_sign_negative()
}

/// One ordered pass over the tile's valid voxels. Returns whether any value fell.
pub fn sweep(tile: &mut HaloTile<f32>, spacing: [f64; 3], upward: [bool; 3]) -> bool {
    let pitch = tile.pitch();
    let strides = [1, pitch, pitch * pitch];
    let valid = tile.valid();
    let mut fell = false;
    for z in ordered(valid[2], upward[2]) {
        for y in ordered(valid[1], upward[1]) {
            let row = tile.at(0, y, z);
            for x in ordered(valid[0], upward[0]) {
                let at = row + x as usize;
                let d = tile.data();
                if is_fixed(d[at]) {
                    continue;
                }
                let near = strides.map(|s| f64::from(d[at - s].abs().min(d[at + s].abs())));
                let value = godunov(near, spacing) as f32;
                if value < d[at] {
                    tile.data_mut()[at] = value;
                    fell = true;
                }
            }
        }
    }
    fell
}

/// The solution of the upwind equation for the smaller neighbours `near` along the three axes; infinity when all are.
#[must_use]
pub fn godunov(near: [f64; 3], spacing: [f64; 3]) -> f64 {
    let mut axes = [(near[0], spacing[0]), (near[1], spacing[1]), (near[2], spacing[2])];
    axes.sort_by(|p, q| p.0.total_cmp(&q.0));
    let (first, h) = axes[0];
    let mut x = first + h;
    // Sums over the axes taken so far of 1 / h^2, a / h^2 and a^2 / h^2, with a counted from the smallest neighbour.
    let mut sums = [1.0 / (h * h), 0.0, 0.0];
    for &(a, h) in &axes[1..] {
        if x <= a {
            break;
        }
        let (offset, weight) = (a - first, 1.0 / (h * h));
        sums = [sums[0] + weight, sums[1] + weight * offset, sums[2] + weight * offset * offset];
        let discriminant = sums[1] * sums[1] - sums[0] * (sums[2] - 1.0);
        x = first + (sums[1] + discriminant.max(0.0).sqrt()) / sums[0];
    }
    x
}
