//! How the scheme of a cell lies in memory: the linear system `u_p = r_p + sum w_pq u_q` (algorithms: section 5).
//!
//! Relaxation corrects one colour at a time, and along a row every second voxel has the same colour. So each row of 16
//! voxels is kept as two halves, even x and odd x, and a half fills a vector with one colour alone. What the solver
//! reads one after the other lies so too:
//!
//! ```text
//! [z][colour][y][layer][x / 2]     colour: (x + y + z) % 2; layers: w across -x, +x, -y, +y, -z, +z, then r
//! ```

use super::{CELL, CELL_LEN};

/// Values per voxel: six weights and the right side.
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

/// Voxels that are assembled at a time.
pub(crate) const LANES: usize = 8;

/// Writes the voxels from `[x, y, z]` on, x a multiple of their number. `terms` are the coefficients c towards the six
/// neighbours and the old values; each is divided by the diagonal, `1 + sum c`.
#[inline(always)]
pub(crate) fn write_part(scheme: &mut [f32], at: [usize; 3], terms: &mut [[f32; LANES]; SCHEME_LAYERS]) {
    let mut diagonal = [1.0f32; LANES];
    for c in &terms[..6] {
        for x in 0..LANES {
            diagonal[x] += c[x];
        }
    }
    let inverse = diagonal.map(|d| 1.0 / d);
    for term in terms.iter_mut() {
        for x in 0..LANES {
            term[x] *= inverse[x];
        }
    }
    split(terms, scheme, at);
}

/// Writes even and odd voxels where their halves of the row lie.
///
/// Kept apart: inlined, the shuffles turn all arithmetic before them into scalar code.
#[inline(never)]
fn split(terms: &[[f32; LANES]; SCHEME_LAYERS], scheme: &mut [f32], [x, y, z]: [usize; 3]) {
    const EACH: usize = LANES / 2;
    let (even, odd) = (half_start((y + z) % 2, y, z) + x / 2, half_start((y + z + 1) % 2, y, z) + x / 2);
    for (layer, [e0, o0, e1, o1, e2, o2, e3, o3]) in terms.iter().enumerate() {
        scheme[even + layer * HALF..][..EACH].copy_from_slice(&[*e0, *e1, *e2, *e3]);
        scheme[odd + layer * HALF..][..EACH].copy_from_slice(&[*o0, *o1, *o2, *o3]);
    }
}
