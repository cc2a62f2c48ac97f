//! Whether a cloud lies in one plane or on one line: then it has no inside, and no setting gives it one.
//!
//! The widths of a cloud along its principal axes are the roots of the eigenvalues of its covariance (Pearson 1901),
//! which for a symmetric matrix of three rows have a closed form (Smith 1961).

use std::f64::consts::PI;

/// What is said of a cloud in a plane.
pub(super) const IN_ONE_PLANE: &str = "in one plane";

/// Where all points lie, as far as `within` does not matter: "on one line", "in one plane", or none of both.
#[must_use]
pub(super) fn flat(points: &[[f64; 3]], within: f64) -> Option<&'static str> {
    let [smallest, middle, _] = widths(points)?;
    match (smallest < within, middle < within) {
        (_, true) => Some("on one line"),
        (true, false) => Some(IN_ONE_PLANE),
        (false, false) => None,
    }
}

/// The root mean square distances of the points from the middle along the principal axes, the smallest first.
fn widths(points: &[[f64; 3]]) -> Option<[f64; 3]> {
    let first = points.first()?;
    let count = points.len() as f64;
    let seen = || points.iter().map(|p| -> [f64; 3] { std::array::from_fn(|a| p[a] - first[a]) });
    let mean: [f64; 3] = std::array::from_fn(|a| seen().map(|p| p[a]).sum::<f64>() / count);
    let moment = |a: usize, b: usize| seen().map(|p| (p[a] - mean[a]) * (p[b] - mean[b])).sum::<f64>() / count;
    let [xx, yy, zz] = [0, 1, 2].map(|a| moment(a, a));
    let [xy, yz, xz] = [moment(0, 1), moment(1, 2), moment(0, 2)];
    let third = (xx + yy + zz) / 3.0;
    let [dx, dy, dz] = [xx, yy, zz].map(|v| v - third);
    let scale = ((dx * dx + dy * dy + dz * dz + 2.0 * (xy * xy + yz * yz + xz * xz)) / 6.0).sqrt();
    if scale <= 0.0 {
        return Some([third.sqrt(); 3]);
    }
    let determinant = dx * (dy * dz - yz * yz) - xy * (xy * dz - yz * xz) + xz * (xy * yz - dy * xz);
    let angle = libm::acos((determinant / (2.0 * scale * scale * scale)).clamp(-1.0, 1.0)) / 3.0;
    let values = [2.0 * PI / 3.0, 4.0 * PI / 3.0, 0.0].map(|turn| third + 2.0 * scale * libm::cos(angle + turn));
    Some(values.map(|value| value.max(0.0).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_and_lines_however_they_lie() {
        let grid = |n: u32| (f64::from(n % 20), f64::from(n / 20));
        let at = |(u, v): (f64, f64)| -> [f64; 3] {
            std::array::from_fn(|a| [5e5, 4e6, 1.0][a] + u * [1.0, 0.0, 0.5][a] + v * [0.0, 1.0, 2.0][a])
        };
        let plane: Vec<_> = (0..400).map(|n| at(grid(n))).collect();
        let line: Vec<_> = (0..50).map(|n| at((f64::from(n), 0.0))).collect();
        let mut body = plane.clone();
        body.iter_mut().step_by(2).for_each(|p| p[2] += 1.0);
        assert_eq!(flat(&plane, 0.05), Some("in one plane"));
        assert_eq!(flat(&line, 0.05), Some("on one line"));
        assert_eq!(flat(&body, 0.05), None);
        assert_eq!(flat(&plane[..1], 0.05), Some("on one line"));
        assert_eq!(flat(&[], 0.05), None);
    }

    /// Of a box of points the widths along its own axes are those of even distributions.
    #[test]
    fn widths_of_a_lattice() {
        let place = |n: u32| [f64::from(n % 3), 2.0 * f64::from(n / 3 % 4), 10.0 * f64::from(n / 12)];
        let lattice: Vec<_> = (0..60).map(place).collect();
        // A row of n points with a step h has the variance h^2 (n^2 - 1) / 12.
        let expected =
            [(1.0, 3.0), (2.0, 4.0), (10.0, 5.0)].map(|(h, n): (f64, f64)| h * ((n * n - 1.0) / 12.0).sqrt());
        let found = widths(&lattice).unwrap();
        assert!(found.iter().zip(expected).all(|(f, e)| (f - e).abs() < 1e-9), "{found:?} {expected:?}");
    }
}
