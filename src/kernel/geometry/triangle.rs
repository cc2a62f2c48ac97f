//! The point of a triangle closest to a given point (Eberly, Distance Between Point and Triangle in 3D, 1999),
//! by the region tests of Ericson, Real-Time Collision Detection, section 5.1.5.
//!
//! With q = a + s ab + t ac the squared distance is a quadratic in (s, t); its minimum over the triangle lies inside,
//! on an edge or at a corner, and the signs of its gradient tell which. Triangles with next to no height act as the
//! segments that bound them, those of three equal corners as a point.

use glam::DVec3;

/// Below this squared ratio of height to length the region tests lose their digits: such triangles are thin.
const THIN: f64 = 1e-8;

/// A triangle, ready to be asked for distances.
#[derive(Clone, Copy, Debug)]
pub struct Triangle {
    a: DVec3,
    ab: DVec3,
    ac: DVec3,
    /// ab . ab, ab . ac and ac . ac.
    gram: [f64; 3],
    /// The determinant of these: four times the squared area.
    determinant: f64,
    is_thin: bool,
}

impl Triangle {
    /// The triangle of three corners.
    #[must_use]
    pub fn new(corners: [[f64; 3]; 3]) -> Self {
        let [a, b, c] = corners.map(DVec3::from);
        let (ab, ac) = (b - a, c - a);
        let gram = [ab.length_squared(), ab.dot(ac), ac.length_squared()];
        let determinant = ab.cross(ac).length_squared();
        let longest = gram[0].max(gram[2]).max(c.distance_squared(b));
        Self { a, ab, ac, gram, determinant, is_thin: determinant <= THIN * longest * longest }
    }

    /// How far the farthest of its points is from the first corner.
    #[must_use]
    pub fn longest_from_corner(&self) -> f64 {
        self.gram[0].max(self.gram[2]).sqrt()
    }

    /// Its first corner.
    #[must_use]
    pub fn corner(&self) -> [f64; 3] {
        self.a.into()
    }

    /// The squared distance from `point` to the triangle.
    #[must_use]
    pub fn distance_squared(&self, point: [f64; 3]) -> f64 {
        DVec3::from(point).distance_squared(self.closest(point.into()))
    }

    /// The point of the triangle closest to `point`.
    #[must_use]
    pub fn closest_point(&self, point: [f64; 3]) -> [f64; 3] {
        self.closest(point.into()).into()
    }

    fn closest(&self, point: DVec3) -> DVec3 {
        let ap = point - self.a;
        let (d1, d2) = (self.ab.dot(ap), self.ac.dot(ap));
        if self.is_thin { self.closest_of_thin(point, d1, d2) } else { self.closest_by_region(d1, d2) }
    }

    /// The region tests; `d1`, `d2` are ab . ap and ac . ap.
    fn closest_by_region(&self, d1: f64, d2: f64) -> DVec3 {
        let [g11, g12, g22] = self.gram;
        if d1 <= 0.0 && d2 <= 0.0 {
            return self.at(0.0, 0.0);
        }
        let (d3, d4) = (d1 - g11, d2 - g12);
        if d3 >= 0.0 && d4 <= d3 {
            return self.at(1.0, 0.0);
        }
        let (d5, d6) = (d1 - g12, d2 - g22);
        if d6 >= 0.0 && d5 <= d6 {
            return self.at(0.0, 1.0);
        }
        let (s, t) = (g22 * d1 - g12 * d2, g11 * d2 - g12 * d1);
        if t <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return self.at(d1 / g11, 0.0);
        }
        if s <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return self.at(0.0, d2 / g22);
        }
        let (from_b, from_c) = (d4 - d3, d5 - d6);
        if s + t >= self.determinant && from_b >= 0.0 && from_c >= 0.0 {
            let along = from_b / (from_b + from_c);
            return self.at(1.0 - along, along);
        }
        self.at(s / self.determinant, t / self.determinant)
    }

    /// The nearest of the three segments' points and, where it exists, the point inside.
    fn closest_of_thin(&self, point: DVec3, d1: f64, d2: f64) -> DVec3 {
        let [g11, g12, g22] = self.gram;
        let along_bc = ratio((d2 - g12) - (d1 - g11), g11 - 2.0 * g12 + g22);
        let s = ratio(g22 * d1 - g12 * d2, self.determinant);
        let t = ratio(g11 * d2 - g12 * d1, self.determinant).min(1.0 - s);
        let candidates = [
            self.at(ratio(d1, g11), 0.0),
            self.at(0.0, ratio(d2, g22)),
            self.at(1.0 - along_bc, along_bc),
            self.at(s, t),
        ];
        let nearer = |q: DVec3, best| point.distance_squared(q) < point.distance_squared(best);
        candidates.into_iter().fold(self.a, |best, q| if nearer(q, best) { q } else { best })
    }

    fn at(&self, s: f64, t: f64) -> DVec3 {
        self.a + s * self.ab + t * self.ac
    }
}

/// The quotient held within [0, 1], 0 where there is none.
fn ratio(numerator: f64, denominator: f64) -> f64 {
    if denominator > 0.0 { (numerator / denominator).clamp(0.0, 1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The distance by another way: down to the plane where that lands inside, else to the nearest edge.
    fn reference(p: [f64; 3], corners: [[f64; 3]; 3]) -> f64 {
        let (p, [a, b, c]) = (DVec3::from(p), corners.map(DVec3::from));
        let segment = |from: DVec3, to: DVec3| {
            let along = to - from;
            let length = along.length_squared();
            let s = if length > 0.0 { ((p - from).dot(along) / length).clamp(0.0, 1.0) } else { 0.0 };
            (p - from - s * along).length()
        };
        let normal = (b - a).cross(c - a);
        let is_left = |from: DVec3, to: DVec3| (to - from).cross(p - from).dot(normal) >= 0.0;
        let size = normal.length();
        if size > 1e-9 && is_left(a, b) && is_left(b, c) && is_left(c, a) {
            return (p - a).dot(normal).abs() / size;
        }
        segment(a, b).min(segment(b, c)).min(segment(c, a))
    }

    fn point() -> impl Strategy<Value = [f64; 3]> {
        prop::array::uniform3(prop_oneof![-3.0..3.0_f64, (-2_i32..3).prop_map(f64::from)])
    }

    proptest! {
        #[test]
        fn agrees_with_plane_and_segments(p in point(), corners in prop::array::uniform3(point())) {
            let triangle = Triangle::new(corners);
            prop_assert!((triangle.distance_squared(p).sqrt() - reference(p, corners)).abs() < 1e-7);
            // The closest point lies in the triangle: it has no distance to it.
            prop_assert!(reference(triangle.closest_point(p), corners) < 1e-6);
        }

        #[test]
        fn thin_triangles_act_as_their_segments(p in point(), a in point(), b in point(), s in 0.0..1.0_f64, e in 0_i32..14) {
            let nudge = if e > 12 { 0.0 } else { 10.0_f64.powi(-e) };
            let mut c: [f64; 3] = std::array::from_fn(|i| a[i] + s * (b[i] - a[i]));
            c[2] += nudge;
            let found = Triangle::new([a, b, c]).distance_squared(p).sqrt();
            let tolerance = if nudge < 1e-5 { 2.0 * nudge + 1e-9 } else { 1e-6 };
            prop_assert!((found - reference(p, [a, b, c])).abs() < tolerance);
        }
    }

    #[test]
    fn the_seven_regions() {
        let triangle = Triangle::new([[0.0; 3], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]]);
        let cases = [
            ([1.0, 1.0, 2.0], [1.0, 1.0, 0.0]),
            ([-1.0, -2.0, 5.0], [0.0, 0.0, 0.0]),
            ([7.0, -1.0, 1.0], [4.0, 0.0, 0.0]),
            ([-1.0, 9.0, 1.0], [0.0, 3.0, 0.0]),
            ([2.5, -3.0, 1.0], [2.5, 0.0, 0.0]),
            ([-3.0, 1.25, 1.0], [0.0, 1.25, 0.0]),
            ([2.0 + 3.0, 1.5 + 4.0, 7.0], [2.0, 1.5, 0.0]),
        ];
        for (p, expected) in cases {
            let found = triangle.closest_point(p);
            assert!((0..3).all(|i| (found[i] - expected[i]).abs() < 1e-14), "{p:?}: {found:?}");
        }
    }

    #[test]
    fn three_equal_corners_are_a_point() {
        let triangle = Triangle::new([[1.0, 2.0, 3.0]; 3]);
        assert_eq!(triangle.closest_point([9.0, 9.0, 9.0]), [1.0, 2.0, 3.0]);
        assert_eq!(triangle.distance_squared([1.0, 2.0, 5.0]), 4.0);
    }
}
