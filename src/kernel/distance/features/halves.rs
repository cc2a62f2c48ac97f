//! `halves`: how boxes are divided until few sources are left to each part.

use crate::grid::Box3;

/// The two halves of a box along its longest axis.
pub(super) fn halves(part: &Box3) -> [Box3; 2] {
    let shape = part.shape();
    let axis = (0..3).rev().max_by_key(|&a| shape[a]).unwrap_or(0);
    let cut = part.lo[axis] + shape[axis] / 2;
    let (mut lower, mut upper) = (*part, *part);
    (lower.hi[axis], upper.lo[axis]) = (cut, cut);
    [lower, upper]
}
