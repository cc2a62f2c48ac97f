//! Presmoothing: one implicit step of the heat equation on one cell (Kósa PhD, sec. 3; docs/algorithms.md, "Grey range
//! and presmoothing").
//!
//! `(1 - tau Laplace) I = I_0` with `tau = sigma^2 / 2`, the 7-point Laplacian with the true spacing and homogeneous
//! Neumann borders. Divided by its diagonal it has the same form as a time step of the level set, so the same
//! relaxation solves it.

use crate::kernel::level_set::cell::{CELL, CELL_LEN, GROWN};
use crate::kernel::level_set::scheme::coefficients::{NO_COEFFICIENTS, close, normalise};
use crate::kernel::level_set::scheme::mask::CellMask;
use crate::kernel::level_set::scheme::system::write_plane;

/// Fills the scheme of one cell; `initial` is `I_0` dense over the cell, `mask` says which faces are open.
///
/// # Panics
/// When `initial` is not a cell or `out` not a scheme.
pub fn scheme(initial: &[f32], mask: &CellMask, spacing: [f64; 3], sigma: f64, out: &mut [f32]) {
    assert_eq!(initial.len(), CELL_LEN, "a cell of intensities");
    let step = spacing.map(|h| (0.5 * sigma * sigma / (h * h)) as f32);
    vectorised!({ initial: &[f32], mask: &CellMask, step: [f32; 3], out: &mut [f32] } => scheme_planes);
}

#[inline(always)]
fn scheme_planes(initial: &[f32], mask: &CellMask, step: [f32; 3], out: &mut [f32]) {
    let rows = [0, CELL];
    let mut terms = NO_COEFFICIENTS;
    for z in 0..CELL {
        for y in 0..CELL {
            let row = (z * CELL + y) * CELL;
            let solved = &mask.solved[row..][..CELL];
            for (q, term) in terms[..6].iter_mut().enumerate() {
                for (c, &solved) in term[y * GROWN..][..CELL].iter_mut().zip(solved) {
                    *c = f32::from(solved) * step[q / 2];
                }
            }
            terms[6][y * GROWN..][..CELL].copy_from_slice(&initial[row..][..CELL]);
        }
        close(&mut terms, mask, z, rows);
        normalise(rows, &mut terms);
        write_plane(out, z, rows, &terms);
    }
}
