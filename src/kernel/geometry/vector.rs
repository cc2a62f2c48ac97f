//! Unit vectors and small systems of equations. Vectors are `glam`'s, whose f64 arithmetic is plain, component by component, `x`, `y`, `z` in this order.

use glam::DVec3;

/// A vector of the same direction with length 1; 0 where it has no length. Divides, where `normalize` multiplies by a rounded inverse.
pub(crate) fn unit(v: DVec3) -> DVec3 {
    let length = v.length();
    if length > 0.0 { v / length } else { DVec3::ZERO }
}

/// The solution of a few linear equations, each a row with its right side at the end; none where they have no single one.
pub(crate) fn solved(mut rows: Vec<Vec<f64>>) -> Option<Vec<f64>> {
    let count = rows.len();
    let largest = rows.iter().flatten().fold(0.0_f64, |m, v| m.max(v.abs()));
    for column in 0..count {
        let pivot = (column..count).max_by(|&a, &b| rows[a][column].abs().total_cmp(&rows[b][column].abs()))?;
        let size = rows[pivot][column].abs();
        if !(size.is_finite() && size > 1e-9 * largest) {
            return None;
        }
        rows.swap(column, pivot);
        let leading = rows[column].clone();
        for (_, row) in rows.iter_mut().enumerate().filter(|(n, _)| *n != column) {
            let factor = row[column] / leading[column];
            row.iter_mut().zip(&leading).for_each(|(value, lead)| *value -= factor * lead);
        }
    }
    Some((0..count).map(|n| rows[n][count] / rows[n][n]).collect())
}
