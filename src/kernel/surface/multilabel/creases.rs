//! Creases: where a surface bends sharply within a triangle of three voxels, its two sides meet in a corner there, not
//! on the straight line between the edges that they cross (after Kobbelt et al. 2001, Feature sensitive surface
//! extraction).

use crate::kernel::geometry::vector::{cross, dot, solved, sub};

/// Two directions whose cosine is less are of different sides of a crease: 26 degrees.
const SHARP: f64 = 0.9;
/// So far inside the triangle a corner lies at least, in weights of its corners.
const INSIDE: f64 = 1.0 / 64.0;
/// How much a peak is drawn to the middle of what meets in it, beside sides of weight 1: sides may be nearly parallel.
const TOWARDS_AROUND: f64 = 1e-3;

/// A point of the surface, and the direction across it, of unit length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    pub(crate) place: [f64; 3],
    pub(crate) normal: [f64; 3],
}

/// Where the sides that two edges of a triangle cross meet within it, as weights of its corners; none where the surface
/// does not bend sharply or they meet elsewhere.
pub(crate) fn corner(triangle: [[f64; 3]; 3], [one, other]: [Crossing; 2]) -> Option<[f64; 3]> {
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
    if size <= 0.0 || determinant.abs() <= 0.1 * (libm::hypot(a, b) * libm::hypot(c, d)) {
        return None;
    }
    let (s, t) = ((e * d - b * f) / determinant, (a * f - e * c) / determinant);
    let weights = [1.0 - s - t, s, t];
    weights.iter().all(|&weight| weight >= INSIDE).then_some(weights)
}

/// Where three or more sides meet: the place nearest to all of them, and a little to `around`, in the sense of least
/// squares; `around` itself where that is not within the tetrahedron.
pub(crate) fn peak(tetrahedron: [[f64; 3]; 4], sides: &[Crossing], around: [f64; 3]) -> [f64; 3] {
    let rows = (0..3).map(|row| {
        let column = |n: usize| {
            let pull = if n == row { TOWARDS_AROUND } else { 0.0 };
            sides.iter().map(|side| side.normal[row] * side.normal[n]).sum::<f64>() + pull
        };
        let right = sides.iter().map(|side| side.normal[row] * dot(side.normal, sub(side.place, around))).sum();
        (0..3).map(column).chain([right]).collect()
    });
    let Some(step) = solved(rows.collect()) else { return around };
    let found: [f64; 3] = std::array::from_fn(|a| around[a] + step[a]);
    let from = tetrahedron[0];
    let edges = [1, 2, 3].map(|n| sub(tetrahedron[n], from));
    let rows = (0..3).map(|a| edges.iter().map(|edge| edge[a]).chain([found[a] - from[a]]).collect());
    let is_inside = solved(rows.collect())
        .is_some_and(|weights| weights.iter().all(|w| *w > INSIDE) && weights.iter().sum::<f64>() < 1.0 - INSIDE);
    if is_inside { found } else { around }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_sides_meet_in_a_peak() {
        let tetrahedron = [[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]];
        let side = |axis: usize, at: f64| {
            let along = |value| std::array::from_fn(|a| if a == axis { value } else { 0.0 });
            Crossing { place: along(at), normal: along(1.0) }
        };
        let found = peak(tetrahedron, &[side(0, 0.3), side(1, 0.4), side(2, 0.5)], [0.5; 3]);
        assert!((0..3).all(|a| (found[a] - [0.3, 0.4, 0.5][a]).abs() < 1e-3), "{found:?}");
        assert_eq!(peak(tetrahedron, &[side(0, 1.5), side(1, 1.0), side(2, 0.5)], [0.5; 3]), [0.5; 3], "outside");
    }

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
