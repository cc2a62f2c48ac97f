//! The edge detector `g = 1 / (1 + K s^2)` (Perona & Malik 1990; Kósa PhD, eq. 2.4; docs/algorithms.md, "Edge
//! detector").
//!
//! `s` is the mean of the 24 tetrahedral gradient norms of the smoothed image, in units of intensity (0..1) per
//! `length`; with the smallest spacing as that length, K means the same for every unit and every sampling. The papers
//! do not say for which range of intensities K is; theirs too is read as for 0..1.

use crate::kernel::level_set::scheme::covolume::{Planes, mean_gradient};

/// g on one cell, in `(0, 1]`: `smoothed` is a grown cell, `out` a cell.
///
/// # Panics
/// When the arrays have other sizes.
pub fn edge_detector(smoothed: &[f32], spacing: [f64; 3], length: f64, k: f32, work: &mut Planes, out: &mut [f32]) {
    mean_gradient(smoothed, spacing.map(|h| h / length), work, out);
    for s in out {
        *s = 1.0 / (1.0 + k * *s * *s);
    }
}
