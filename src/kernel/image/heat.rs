//! Presmoothing: one implicit step of the heat equation on one cell (Kósa PhD, sec. 3; algorithms: section 6).
//!
//! `(1 - tau Laplace) I = I_0` with `tau = sigma^2 / 2`, the 7-point Laplacian with the true spacing and homogeneous
//! Neumann borders. Divided by its diagonal it has the same form as a time step of the level set, so the same
//! relaxation solves it.

use crate::kernel::level_set::covolume::CellMask;
use crate::kernel::level_set::scheme::{LANES, SCHEME_LAYERS, write_part};
use crate::kernel::level_set::{CELL, CELL_LEN};

/// Fills the scheme of one cell; `initial` is `I_0` dense over the cell, `mask` says which faces are open.
///
/// # Panics
/// When `initial` is not a cell or `out` not a scheme.
pub fn scheme(initial: &[f32], mask: &CellMask, spacing: [f64; 3], sigma: f64, out: &mut [f32]) {
    assert_eq!(initial.len(), CELL_LEN, "a cell of intensities");
    let step = spacing.map(|h| (0.5 * sigma * sigma / (h * h)) as f32);
    vectorised!({ initial: &[f32], mask: &CellMask, step: [f32; 3], out: &mut [f32] } => scheme_rows);
}

#[inline(always)]
fn scheme_rows(initial: &[f32], mask: &CellMask, step: [f32; 3], out: &mut [f32]) {
    let (parts, _) = initial.as_chunks::<LANES>();
    let (solved, _) = mask.solved.as_chunks::<LANES>();
    for (n, (initial, solved)) in parts.iter().zip(solved).enumerate() {
        let [start, y, z] = [n * LANES % CELL, n * LANES / CELL % CELL, n * LANES / (CELL * CELL)];
        let mut terms = [[0.0f32; LANES]; SCHEME_LAYERS];
        for (q, c) in terms[..6].iter_mut().enumerate() {
            let open = &mask.open[q / 2][q % 2];
            for x in 0..LANES {
                let beyond = [open[start + x], open[y], open[z]][q / 2];
                c[x] = f32::from(solved[x]) * step[q / 2] * beyond;
            }
        }
        terms[6] = *initial;
        write_part(out, [start, y, z], &mut terms);
    }
}
