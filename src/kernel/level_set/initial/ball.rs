//! A ball as the start of the time loop, on one brick; every voxel of the domain is solved.

use crate::grid::{Box3, Geometry};

/// Sets u to 1 within `radius` of `centre`, world coordinates, to 0 elsewhere, and `solved` to 1 at all voxels of the
/// domain.
/// `u` and `solved` are dense bricks `[z][y][x]` with row length and plane height `edge`, `part` is the brick's box.
pub fn start(
    geometry: &Geometry,
    part: &Box3,
    edge: usize,
    centre: [f64; 3],
    radius: f64,
    u: &mut [f32],
    solved: &mut [u8],
) {
    for (y, z) in part.rows() {
        let row = ((z - part.lo[2]) as usize * edge + (y - part.lo[1]) as usize) * edge;
        for (x, place) in (part.lo[0]..part.hi[0]).zip(row..) {
            let at = geometry.position([x, y, z]);
            let squared: f64 = (0..3).map(|a| (at[a] - centre[a]).powi(2)).sum();
            u[place] = if squared <= radius * radius { 1.0 } else { 0.0 };
            solved[place] = 1;
        }
    }
}
