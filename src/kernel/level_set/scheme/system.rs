//! How the scheme of a cell lies in memory: the linear system `u_p = old_p + sum w_pq (u_q - old_p)`
//! (docs/algorithms.md, "Co-volume scheme").
//!
//! Relaxation corrects one colour at a time, and along a row every second voxel has the same colour. So each row of 16
//! voxels is kept as two halves, even x and odd x, and a half fills a vector with one colour alone. What the solver
//! reads one after the other lies so too:
//!
//! ```text
//! [z][colour][y][layer][x / 2]     colour: (x + y + z) % 2; layers: w across -x, +x, -y, +y, -z, +z, then old
//! ```

use crate::kernel::level_set::cell::{CELL, CELL_LEN, FLAT, GROWN};

/// Values per voxel: six weights and the old value.
pub const SCHEME_LAYERS: usize = 7;
/// Values of a scheme.
pub const SCHEME_LEN: usize = SCHEME_LAYERS * CELL_LEN;
/// Voxels of one parity in a row.
pub(crate) const HALF: usize = CELL / 2;
/// Values of one half of a row.
pub(crate) const HALF_LEN: usize = SCHEME_LAYERS * HALF;

/// Where a scheme keeps a layer's value for the voxel `[x, y, z]` of the cell.
#[must_use]
pub fn scheme_place(layer: usize, [x, y, z]: [usize; 3]) -> usize {
    half_start((x + y + z) % 2, y, z) + layer * HALF + x / 2
}

/// Start of the half row of the given colour.
#[inline(always)]
pub(crate) fn half_start(colour: usize, y: usize, z: usize) -> usize {
    ((z * 2 + colour) * CELL + y) * HALF_LEN
}

/// Writes the given rows of plane z, whose terms lie flat, row y from `y * GROWN` on: even and odd voxels go where
/// their halves of the row are.
#[inline(always)]
pub(crate) fn write_plane(scheme: &mut [f32], z: usize, rows: [usize; 2], terms: &[[f32; FLAT]; SCHEME_LAYERS]) {
    for y in rows[0]..rows[1] {
        for parity in 0..2 {
            let half = &mut scheme[half_start((y + z + parity) % 2, y, z)..][..HALF_LEN];
            for (half, term) in half.as_chunks_mut::<HALF>().0.iter_mut().zip(terms) {
                let term = &term[y * GROWN..][..CELL];
                for i in 0..HALF {
                    half[i] = term[2 * i + parity];
                }
            }
        }
    }
}
