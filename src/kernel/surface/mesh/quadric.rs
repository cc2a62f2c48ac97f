//! `Quadric`: the planes of triangles, summed so that the place that lies nearest to all of them can be told (Garland and Heckbert,
//! "Surface simplification using quadric error metrics", SIGGRAPH 1997; Lindstrom, "Out-of-core simplification of large polygonal
//! models", SIGGRAPH 2000, section 4).
//!
//! The squared distances of x to the planes n . x = d, weighed by the triangles' areas w, sum to x' A x - 2 b . x + c with
//! A = sum w n n' and b = sum w d n. Where A is singular, as in a flat part, all places of a plane or a line are as near: of these
//! the nearest to the mean x0 of the corners is taken, x0 + A+ (b - A x0), singular values below a thousandth of the largest
//! counted as none.

use glam::{DMat3, DVec3};

use crate::kernel::geometry::eigen::eigen;

/// Singular values below this part of the largest are noise of flat parts.
const LEAST_VALUE: f64 = 1e-3;

/// Sums over the planes of triangles, and over corners.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Quadric {
    /// A: xx, yy, zz, xy, xz, yz.
    matrix: [f64; 6],
    /// b.
    vector: [f64; 3],
    corners: [f64; 3],
    count: f64,
}

impl Quadric {
    /// Adds the plane of a triangle and that corner of it for which it is added.
    pub(super) fn add_plane(&mut self, triangle: [DVec3; 3], corner: DVec3) {
        let [a, b, c] = triangle;
        let normal = (b - a).cross(c - a);
        let weight = normal.length();
        if weight > 0.0 {
            let (n, scaled) = (normal / weight, normal);
            let products =
                [n.x * scaled.x, n.y * scaled.y, n.z * scaled.z, n.x * scaled.y, n.x * scaled.z, n.y * scaled.z];
            self.matrix.iter_mut().zip(products).for_each(|(sum, value)| *sum += value);
            let away = n.dot(a);
            self.vector.iter_mut().zip((scaled * away).to_array()).for_each(|(sum, value)| *sum += value);
        }
        self.corners.iter_mut().zip(corner.to_array()).for_each(|(sum, value)| *sum += value);
        self.count += 1.0;
    }

    /// Adds the planes of another.
    pub(super) fn merge(&mut self, other: &Self) {
        self.matrix.iter_mut().zip(other.matrix).for_each(|(sum, value)| *sum += value);
        self.vector.iter_mut().zip(other.vector).for_each(|(sum, value)| *sum += value);
        self.corners.iter_mut().zip(other.corners).for_each(|(sum, value)| *sum += value);
        self.count += other.count;
    }

    /// The mean of the corners.
    pub(super) fn mean(&self) -> DVec3 {
        DVec3::from(self.corners) / self.count.max(1.0)
    }

    /// The place that is nearest to all planes, and of several such the nearest to the mean.
    pub(super) fn nearest_place(&self) -> DVec3 {
        let [xx, yy, zz, xy, xz, yz] = self.matrix;
        let matrix = DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz]);
        let mean = self.mean();
        let missing = DVec3::from(self.vector) - matrix * mean;
        let (values, vectors) = eigen(matrix);
        let largest = values.max_element();
        let step = |n: usize| {
            let kept = largest > 0.0 && values[n] > LEAST_VALUE * largest;
            if kept { vectors.col(n) * (vectors.col(n).dot(missing) / values[n]) } else { DVec3::ZERO }
        };
        mean + step(0) + step(1) + step(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three planes that meet in a corner, two that meet in an edge, and one alone.
    #[test]
    fn corners_edges_and_planes_are_found() {
        let triangle = |normal: DVec3, through: DVec3| {
            let (u, v) = (normal.any_orthonormal_vector(), normal.cross(normal.any_orthonormal_vector()));
            [through, through + u, through + v]
        };
        let normals = [DVec3::new(1.0, 0.2, 0.1), DVec3::new(-0.3, 1.0, 0.0), DVec3::new(0.1, 0.4, 1.0)];
        let normals = normals.map(DVec3::normalize);
        let corner = DVec3::new(3.0, -2.0, 40.0);
        for planes in 1..=3 {
            let mut quadric = Quadric::default();
            for (n, normal) in normals[..planes].iter().enumerate() {
                let triangle = triangle(*normal, corner);
                (0..3).for_each(|at| quadric.add_plane(triangle, triangle[at] + normals[n] * 0.1));
            }
            let found = quadric.nearest_place();
            let off = normals[..planes].iter().map(|n| n.dot(found - corner).abs()).fold(0.0, f64::max);
            assert!(off < 1e-9, "{planes}: {off}");
            assert!(found.distance(quadric.mean()) < 1.0 + corner.distance(quadric.mean()), "{planes}: {found}");
        }
    }
}
