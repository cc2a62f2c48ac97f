//! Presmoothing: one implicit step of the heat equation on one cell (Kósa PhD, sec. 3; algorithms: section 6).
//!
//! `(1 - tau Laplace) I = I_0` with `tau = sigma^2 / 2`, the 7-point Laplacian with the true spacing and homogeneous
//! Neumann borders. Divided by its diagonal it has the same form as a time step of the level set, so the same
//! relaxation solves it.

use crate::kernel::level_set::covolume::CellMask;
use crate::kernel::level_set::{CELL, CELL_LEN};

/// Fills the scheme of one cell; `initial` is `I_0` dense over the cell, `mask` says which faces are open.
///
/// # Panics
/// When `initial` is not a cell or `out` not a scheme.
pub fn scheme(initial: &[f32], mask: &CellMask, spacing: [f64; 3], sigma: f64, out: &mut [f32]) {
    assert_eq!(initial.len(), CELL_LEN, "a cell of intensities");
    let step = spacing.map(|h| (0.5 * sigma * sigma / (h * h)) as f32);
    for row in 0..CELL * CELL {
        let (y, z) = (row % CELL, row / CELL);
        for x in 0..CELL {
            let place = [x, y, z];
            let at = row * CELL + x;
            let on = f32::from(mask.solved[at]);
            let coefficient = |q: usize| on * step[q / 2] * mask.open[q / 2][q % 2][place[q / 2]];
            let c: [f32; 6] = std::array::from_fn(coefficient);
            let diagonal = 1.0 / (1.0 + (c[0] + c[1]) + (c[2] + c[3]) + (c[4] + c[5]));
            (0..6).for_each(|q| out[q * CELL_LEN + at] = c[q] * diagonal);
            out[6 * CELL_LEN + at] = initial[at] * diagonal;
        }
    }
}
