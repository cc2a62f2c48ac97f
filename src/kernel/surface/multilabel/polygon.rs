//! Cuts a piece of the surface within a tetrahedron, a polygon that may have a crease running through it, into triangles.
//!
//! A diagonal must not lie in a side of the tetrahedron: the tetrahedron behind it might draw it too. Of the cuts that
//! are left the best is the one whose triangles are turned like the surface at their vertices: it keeps the crease.

use glam::DVec3;

use crate::kernel::geometry::vector::unit;

/// A vertex of the polygon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Point {
    /// The corners of the tetrahedron that it lies within, as bits.
    pub(crate) within: u8,
    /// Where it lies, physical.
    pub(crate) place: DVec3,
    /// The direction across the surface there, seen from where the polygon runs counter-clockwise; 0 where it has none.
    pub(crate) normal: DVec3,
}

/// The triangles of a polygon, by the places of their vertices in it.
pub(crate) fn cut(polygon: &[Point]) -> Vec<[usize; 3]> {
    best(polygon, 0, polygon.len() - 1).map_or_else(|| fan(polygon.len()).collect(), |(_, triangles)| triangles)
}

/// The triangles of a polygon from its first vertex on.
pub(crate) fn fan(count: usize) -> impl Iterator<Item = [usize; 3]> {
    (1..count - 1).map(|n| [0, n, n + 1])
}

/// The best cut of the part from one vertex to another, and how well the worst of its triangles is turned, as a cosine.
fn best(polygon: &[Point], from: usize, to: usize) -> Option<(f64, Vec<[usize; 3]>)> {
    if to == from + 1 {
        return Some((1.0, Vec::new()));
    }
    let may_join = |a: usize, b: usize| b == a + 1 || (polygon[a].within | polygon[b].within).count_ones() > 3;
    let mut found: Option<(f64, Vec<[usize; 3]>)> = None;
    for apex in (from + 1..to).filter(|&apex| may_join(from, apex) && may_join(apex, to)) {
        let (Some(before), Some(after)) = (best(polygon, from, apex), best(polygon, apex, to)) else { continue };
        let triangle = [from, apex, to];
        let worst = turned(triangle.map(|n| polygon[n])).min(before.0).min(after.0);
        if found.as_ref().is_none_or(|(best, _)| worst > *best) {
            found = Some((worst, [before.1, after.1, vec![triangle]].concat()));
        }
    }
    found
}

/// The cosine between a triangle's direction and that of the surface at its vertices.
fn turned(points: [Point; 3]) -> f64 {
    let [a, b, c] = points.map(|point| point.place);
    let across = points.iter().map(|point| point.normal).sum::<DVec3>();
    // Three vertices on a crease tell of no direction.
    if across == DVec3::ZERO { 1.0 } else { unit((b - a).cross(c - a)).dot(unit(across)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A roof over four vertices with its ridge along x; two vertices of the ring lie on the ridge.
    #[test]
    fn a_ridge_is_kept() {
        let point =
            |within, place: [f64; 3], normal: [f64; 3]| Point { within, place: place.into(), normal: normal.into() };
        let (left, right) = ([0.0, -0.6, 0.8], [0.0, 0.6, 0.8]);
        let ring = [
            point(0b0011, [0.0, -1.0, 0.0], left),
            point(0b0101, [3.0, -1.0, 0.0], left),
            point(0b1101, [3.5, 0.0, 0.75], [0.0; 3]),
            point(0b1100, [3.0, 1.0, 0.0], right),
            point(0b1010, [0.0, 1.0, 0.0], right),
            point(0b1011, [-0.5, 0.0, 0.75], [0.0; 3]),
        ];
        let triangles = cut(&ring);
        assert_eq!(triangles.len(), 4);
        let has = |side: [usize; 2]| triangles.iter().any(|t| side.iter().all(|n| t.contains(n)));
        assert!(has([2, 5]), "{triangles:?}");
        assert!(triangles.iter().all(|t| turned(t.map(|n| ring[n])) > 0.99), "{triangles:?}");
    }
}
