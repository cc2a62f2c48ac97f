//! Creases: where a surface bends sharply within a triangle of three voxels, its two sides meet in a corner there, not
//! on the straight line between the edges that they cross (after Kobbelt et al. 2001, Feature sensitive surface
//! extraction).

use crate::kernel::vector::{cross, dot, sub};

/// Two directions whose cosine is less are of different sides of a crease: 26 degrees.
const SHARP: f64 = 0.9;
/// So far inside the triangle a corner lies at least, in weights of its corners.
const INSIDE: f64 = 1.0 / 64.0;

/// A point of the surface, and the direction across it, of unit length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crossing {
    pub(super) place: [f64; 3],
    pub(super) normal: [f64; 3],
}

/// Where the sides that two edges of a triangle cross meet within it, as weights of its corners; none where the surface
/// does not bend sharply or they meet elsewhere.
pub(super) fn corner(triangle: [[f64; 3]; 3], [one, other]: [Crossing; 2]) -> Option<[f64; 3]> {
    if dot(one.normal, other.normal) >= SHARP {
        return None;
    }
    let (u, v) = (sub(triangle[1], triangle[0]), sub(triangle[2], triangle[0]));
    let across = cross(u, v);
    let size = dot(across, across);
    // The two sides as lines s (n.u) + t (n.v) = n.(place - first corner), s and t the weights of the other corners.
    let line = |side: Crossing| {
        let from = sub(side.place, triangle[0]);
        [dot(side.normal, u), dot(side.normal, v), dot(side.normal, from)]
    };
    let ([a, b, e], [c, d, f]) = (line(one), line(other));
    let determinant = a * d - b * c;
    // Lines that are nearly one meet anywhere.
    if size <= 0.0 || determinant.abs() <= 0.1 * (a.hypot(b) * c.hypot(d)) {
        return None;
    }
    let (s, t) = ((e * d - b * f) / determinant, (a * f - e * c) / determinant);
    let weights = [1.0 - s - t, s, t];
    weights.iter().all(|&weight| weight >= INSIDE).then_some(weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [[f64; 3]; 3] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    #[test]
    fn two_sides_meet_in_a_corner() {
        // The planes x = 0.3 and y = 0.4, seen on the edges along x and y.
        let x = Crossing { place: [0.3, 0.0, 0.0], normal: [1.0, 0.0, 0.0] };
        let y = Crossing { place: [0.0, 0.4, 0.0], normal: [0.0, 1.0, 0.0] };
        let [a, b, c] = corner(TRIANGLE, [x, y]).unwrap();
        assert!((a - 0.3).abs() < 1e-12 && (b - 0.3).abs() < 1e-12 && (c - 0.4).abs() < 1e-12);
        assert_eq!(corner(TRIANGLE, [x, x]), None, "no bend");
        let outside = Crossing { place: [0.0, 0.9, 0.0], ..y };
        assert_eq!(corner(TRIANGLE, [x, outside]), None);
    }
}
