//! The plane that an outline was drawn in: across an axis where it is flat in one, else through the outline itself.

use glam::DVec3;

use crate::kernel::geometry::vector::unit;

/// A plane with coordinates of its own. Lengths are physical.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Its unit normal; the largest component is positive.
    pub normal: [f64; 3],
    /// `normal . p` of its points.
    pub offset: f64,
    axes: [DVec3; 2],
}

/// Outlines whose normals differ by less than this angle's cosine are parallel (about half a degree).
const PARALLEL: f64 = 0.999_96;

/// Points that scatter around a plane lie so many tolerances from it at most, and in the root mean square. Those of two
/// neighbouring slices do not.
const LOOSE: [f64; 2] = [2.0, 0.7];

impl Plane {
    fn new(normal: [f64; 3], offset: f64) -> Self {
        let largest = (0..3).max_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs())).unwrap_or(0);
        let sign = if normal[largest] < 0.0 { -1.0 } else { 1.0 };
        let normal = normal.map(|v| sign * v);
        let (across, along) = (DVec3::from(normal), DVec3::AXES[(largest + 1) % 3]);
        let first = unit(along - across * across.dot(along));
        Self { normal, offset: sign * offset, axes: [first, across.cross(first)] }
    }

    /// The plane of a closed outline: of an axis, if it is flat within half of `tolerance` (a length for each axis); else
    /// its own, if it is flat within the smallest of these in that, or the axis' again, if it is only loosely flat there
    /// and hardly flatter in its own: its points scatter.
    #[must_use]
    pub fn of(outline: &[[f64; 3]], tolerance: [f64; 3]) -> Option<Self> {
        if outline.len() < 3 {
            return None;
        }
        let count = outline.len() as f64;
        let mean: [f64; 3] = std::array::from_fn(|a| outline.iter().map(|p| p[a]).sum::<f64>() / count);
        let flat = |axis: &usize| outline.iter().all(|p| (p[*axis] - mean[*axis]).abs() <= 0.5 * tolerance[*axis]);
        let across = |axis: usize| Self::new(std::array::from_fn(|a| if a == axis { 1.0 } else { 0.0 }), mean[axis]);
        if let Some(axis) = [2, 1, 0].into_iter().find(flat) {
            return Some(across(axis));
        }
        // Newell's normal: the sum of the areas that the edges span with a point.
        let seen = |n: usize| DVec3::from(outline[n % outline.len()]) - DVec3::from(mean);
        let area = (0..outline.len()).fold(DVec3::ZERO, |sum, n| sum + seen(n).cross(seen(n + 1)));
        let normal = unit(area);
        let plane = Self::new(normal.into(), normal.dot(mean.into()));
        let smallest = tolerance.into_iter().fold(f64::INFINITY, f64::min);
        let is_flat = normal != DVec3::ZERO && outline.iter().all(|&p| plane.height(p).abs() <= smallest);
        let scatter =
            |off: &dyn Fn(&[f64; 3]) -> f64| (outline.iter().map(|p| off(p).powi(2)).sum::<f64>() / count).sqrt();
        let own = scatter(&|&p| plane.height(p));
        let loosely = |axis: &usize| {
            let off = |p: &[f64; 3]| p[*axis] - mean[*axis];
            let most = outline.iter().map(|p| off(p).abs()).fold(0.0, f64::max);
            let around = scatter(&off);
            most <= LOOSE[0] * tolerance[*axis] && around <= LOOSE[1] * tolerance[*axis] && own > 0.5 * around
        };
        match [2, 1, 0].into_iter().find(loosely) {
            Some(axis) => Some(across(axis)),
            None => (is_flat && own <= LOOSE[1] * smallest).then_some(plane),
        }
    }

    /// How far a point lies from the plane, along its normal.
    #[must_use]
    pub fn height(&self, point: [f64; 3]) -> f64 {
        DVec3::from(self.normal).dot(point.into()) - self.offset
    }

    /// A point's coordinates in the plane.
    #[must_use]
    pub fn project(&self, point: [f64; 3]) -> [f64; 2] {
        self.axes.map(|axis| axis.dot(point.into()))
    }

    /// The point of the plane with these coordinates, moved by `height` along the normal.
    #[must_use]
    pub fn lift(&self, [u, v]: [f64; 2], height: f64) -> [f64; 3] {
        (u * self.axes[0] + v * self.axes[1] + (self.offset + height) * DVec3::from(self.normal)).into()
    }

    /// True where both planes face the same way.
    #[must_use]
    pub fn is_parallel_to(&self, other: &Self) -> bool {
        DVec3::from(self.normal).dot(other.normal.into()).abs() > PARALLEL
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_of_axes_and_oblique_ones_keep_their_points() {
        let circle = |of: &dyn Fn(f64, f64) -> [f64; 3]| -> Vec<[f64; 3]> {
            (0..12)
                .map(|n| f64::from(n) / 12.0 * std::f64::consts::TAU)
                .map(|t| of(4.0 * t.cos(), 3.0 * t.sin()))
                .collect()
        };
        let tolerance = [0.25, 0.25, 0.5];
        let flat = circle(&|a, b| [a, b, 7.0]);
        assert_eq!(Plane::of(&flat, tolerance).unwrap().normal, [0.0, 0.0, 1.0]);
        let (s, c) = 0.5f64.sin_cos();
        let tilted = circle(&|a, b| [a, c * b + 1.0, s * b - 2.0]);
        let plane = Plane::of(&tilted, tolerance).unwrap();
        for &p in &tilted {
            let there = plane.lift(plane.project(p), plane.height(p));
            assert!((0..3).all(|a| (there[a] - p[a]).abs() < 1e-12), "{p:?} {there:?}");
            assert!(plane.height(p).abs() < 1e-12);
        }
        assert!(!plane.is_parallel_to(&Plane::of(&flat, tolerance).unwrap()));
        assert!(Plane::of(&circle(&|a, b| [a, b, a * b]), tolerance).is_none(), "a saddle is no plane");
        assert!(Plane::of(&[[0.0; 3], [1.0, 1.0, 1.0], [2.0, 2.0, 2.0]], tolerance).is_none(), "a line has none");
    }

    #[test]
    fn points_that_scatter_are_in_their_slice_and_two_slices_are_none() {
        let off = [0.3, -0.2, 0.1, -0.4, 0.25, 0.0, -0.3, 0.4, -0.15, 0.1, 0.35, -0.25];
        let ring = |height: &dyn Fn(usize) -> f64| -> Vec<[f64; 3]> {
            let at = |n: usize| n as f64 * std::f64::consts::TAU / 12.0;
            (0..12).map(|n| [9.0 * at(n).cos(), 9.0 * at(n).sin(), height(n)]).collect()
        };
        let plane = Plane::of(&ring(&|n| 4.0 + off[n]), [0.5; 3]).unwrap();
        assert_eq!(plane.normal, [0.0, 0.0, 1.0]);
        assert_eq!(Plane::of(&ring(&|n| 4.0 + (n % 2) as f64), [0.5; 3]), None);
        let tilted =
            Plane::of(&ring(&|n| 4.0 + 0.9 * (n as f64 * std::f64::consts::TAU / 12.0).cos()), [0.5; 3]).unwrap();
        assert!(tilted.normal[2] < 1.0);
    }
}
