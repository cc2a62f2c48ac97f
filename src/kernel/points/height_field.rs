//! `HeightField`: the surface around a place as a height over its tangent plane, a polynomial of degree two fitted to the
//! points there by weighted least squares (Cazals and Pouget, "Estimating differential quantities using polynomial fitting of
//! osculating jets", 2005; docs/algorithms.md, "Noise of the points").

use glam::{DMat3, DVec3};

use crate::kernel::geometry::eigen::eigen;
use crate::kernel::geometry::vector::{solved, unit};

/// Coefficients: of 1, a, b, a^2, a b, b^2, where a and b are places in the plane.
pub const COEFFICIENTS: usize = 6;

/// A surface fitted around a place.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightField {
    /// Height of the surface over the place, along the normal of the plane.
    pub height: f64,
    /// Unit normal of the surface there.
    pub normal: DVec3,
    /// Its coefficients, of places in units of the radius.
    pub coefficients: [f64; COEFFICIENTS],
    /// How far each of the points lies above it, along the normal of the plane.
    pub residuals: Vec<f64>,
}

impl HeightField {
    /// Fits it to weighed points, over the plane through `at` with a unit normal; `radius` is about how far they are from
    /// there. None where they do not tell all of it: too few, or on one line.
    #[must_use]
    pub fn fitted(points: &[DVec3], weights: &[f64], (at, normal): (DVec3, DVec3), radius: f64) -> Option<Self> {
        let (u, v) = normal.any_orthonormal_pair();
        // Places in units of the radius: then all sums are of one size.
        let local = |point: &DVec3| {
            let away = *point - at;
            let (a, b) = (away.dot(u) / radius, away.dot(v) / radius);
            ([1.0, a, b, a * a, a * b, b * b], away.dot(normal))
        };
        let mut sums = [[0.0; COEFFICIENTS + 1]; COEFFICIENTS];
        for (point, weight) in points.iter().zip(weights) {
            let (terms, height) = local(point);
            for (row, term) in sums.iter_mut().zip(terms) {
                let weighed = weight * term;
                row.iter_mut().zip(terms).for_each(|(sum, other)| *sum += weighed * other);
                row[COEFFICIENTS] += weighed * height;
            }
        }
        let found = solved(sums.iter().map(|row| row.to_vec()).collect())?;
        let above = |point: &DVec3| {
            let (terms, height) = local(point);
            height - terms.iter().zip(&found).map(|(term, coefficient)| term * coefficient).sum::<f64>()
        };
        Some(Self {
            height: found[0],
            normal: unit(normal - (u * found[1] + v * found[2]) / radius),
            coefficients: std::array::from_fn(|n| found[n]),
            residuals: points.iter().map(above).collect(),
        })
    }
}

/// The unit normal of the plane that lies nearest to weighed points through their mean (Pearson 1901).
#[must_use]
pub fn plane_normal(points: &[DVec3], weights: &[f64]) -> DVec3 {
    let (mut sum, mut all) = (DVec3::ZERO, 0.0);
    for (point, weight) in points.iter().zip(weights) {
        sum += *point * *weight;
        all += weight;
    }
    let mean = sum / all;
    let mut moments = DMat3::ZERO;
    for (point, weight) in points.iter().zip(weights) {
        let away = *point - mean;
        moments += DMat3::from_cols(away * away.x, away * away.y, away * away.z) * *weight;
    }
    let (values, vectors) = eigen(moments);
    let smallest = (0..3).min_by(|&a, &b| values[a].total_cmp(&values[b])).unwrap_or(0);
    unit(vectors.col(smallest))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a known paraboloid, turned and moved: its height, normal and nothing left.
    #[test]
    fn a_paraboloid_is_found_as_it_is() {
        let normal = DVec3::new(1.0, -2.0, 0.5).normalize();
        let (u, v) = normal.any_orthonormal_pair();
        let at = DVec3::new(100.0, -7.0, 3.0);
        let height = |a: f64, b: f64| 0.3 + 0.2 * a - 0.1 * b + 0.5 * a * a - 0.4 * a * b + 0.25 * b * b;
        let place = |n: u32| {
            let (a, b) = (f64::from(n % 5) - 2.1, f64::from(n / 5) - 1.7);
            at + u * a + v * b + normal * height(a, b)
        };
        let points: Vec<DVec3> = (0..20).map(place).collect();
        let fitted = HeightField::fitted(&points, &[0.7; 20], (at, normal), 2.0).unwrap();
        assert!((fitted.height - 0.3).abs() < 1e-12, "{fitted:?}");
        assert!(fitted.normal.distance((normal - u * 0.2 + v * 0.1).normalize()) < 1e-12, "{fitted:?}");
        assert!(fitted.residuals.iter().all(|r| r.abs() < 1e-12), "{fitted:?}");
        let line: Vec<DVec3> = (0..20).map(|n| at + u * f64::from(n)).collect();
        assert_eq!(HeightField::fitted(&line, &[1.0; 20], (at, normal), 2.0), None);
    }

    #[test]
    fn planes_have_their_normals() {
        let normal = DVec3::new(-3.0, 1.0, 2.0).normalize();
        let (u, v) = normal.any_orthonormal_pair();
        let points: Vec<DVec3> =
            (0..30).map(|n| DVec3::splat(50.0) + u * f64::from(n % 6) + v * f64::from(n / 6)).collect();
        assert!(plane_normal(&points, &[1.0; 30]).cross(normal).length() < 1e-7);
    }
}
