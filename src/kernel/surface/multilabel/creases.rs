//! Creases: where a surface bends sharply within a triangle of three voxels, its two sides meet in a corner there, not
//! on the straight line between the edges that they cross (after Kobbelt et al. 2001, Feature sensitive surface
//! extraction).

use glam::DVec3;

use crate::kernel::geometry::vector::solved;

/// Two directions whose cosine is less are of different sides of a crease: 26 degrees.
const SHARP: f64 = 0.9;
/// So far inside the triangle a corner lies at least, in weights of its corners.
const INSIDE: f64 = 1.0 / 64.0;
/// How much a peak is drawn to the middle of what meets in it, beside sides of weight 1: sides may be nearly parallel.
const TOWARDS_AROUND: f64 = 1e-3;

/// A point of the surface, and the direction across it, of unit length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Crossing {
    pub(crate) place: DVec3,
    pub(crate) normal: DVec3,
}

/// Where the sides that two edges of a triangle cross meet within it, as weights of its corners; none where the surface
/// does not bend sharply or they meet elsewhere.
pub(crate) fn corner(triangle: [DVec3; 3], [one, other]: [Crossing; 2]) -> Option<[f64; 3]> {
    if one.normal.dot(other.normal) >= SHARP {
        return None;
    }
    let (u, v) = (triangle[1] - triangle[0], triangle[2] - triangle[0]);
    let size = u.cross(v).length_squared();
    // The two sides as lines s (n.u) + t (n.v) = n.(place - first corner), s and t the weights of the other corners.
    let line = |side: Crossing| [u, v, side.place - triangle[0]].map(|along| side.normal.dot(along));
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
pub(crate) fn peak(tetrahedron: [DVec3; 4], sides: &[Crossing], around: DVec3) -> DVec3 {
    let rows = (0..3).map(|row| {
        let column = |n: usize| {
            let pull = if n == row { TOWARDS_AROUND } else { 0.0 };
            sides.iter().map(|side| side.normal[row] * side.normal[n]).sum::<f64>() + pull
        };
        let right = sides.iter().map(|side| side.normal[row] * side.normal.dot(side.place - around)).sum();
        (0..3).map(column).chain([right]).collect()
    });
    let Some(step) = solved(rows.collect()) else { return around };
    let found = around + DVec3::from_slice(&step);
    let from = tetrahedron[0];
    let edges = [1, 2, 3].map(|n| tetrahedron[n] - from);
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
        let tetrahedron = [DVec3::ZERO, 2.0 * DVec3::X, 2.0 * DVec3::Y, 2.0 * DVec3::Z];
        let sides = |at: [f64; 3]| {
            [0, 1, 2].map(|a| (at[a], DVec3::AXES[a])).map(|(at, normal)| Crossing { place: at * normal, normal })
        };
        let around = DVec3::splat(0.5);
        let found = peak(tetrahedron, &sides([0.3, 0.4, 0.5]), around);
        assert!(found.abs_diff_eq(DVec3::new(0.3, 0.4, 0.5), 1e-3), "{found:?}");
        assert_eq!(peak(tetrahedron, &sides([1.5, 1.0, 0.5]), around), around, "outside");
    }

    const TRIANGLE: [DVec3; 3] = [DVec3::ZERO, DVec3::X, DVec3::Y];

    #[test]
    fn two_sides_meet_in_a_corner() {
        // The planes x = 0.3 and y = 0.4, seen on the edges along x and y.
        let x = Crossing { place: 0.3 * DVec3::X, normal: DVec3::X };
        let y = Crossing { place: 0.4 * DVec3::Y, normal: DVec3::Y };
        let [a, b, c] = corner(TRIANGLE, [x, y]).unwrap();
        assert!((a - 0.3).abs() < 1e-12 && (b - 0.3).abs() < 1e-12 && (c - 0.4).abs() < 1e-12);
        assert_eq!(corner(TRIANGLE, [x, x]), None, "no bend");
        let outside = Crossing { place: 0.9 * DVec3::Y, ..y };
        assert_eq!(corner(TRIANGLE, [x, outside]), None);
    }
}
