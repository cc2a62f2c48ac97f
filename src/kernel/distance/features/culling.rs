//! Which of some sources can be the nearest to a place in a box.
//!
//! From a box's middle c let one source be nearest, at its point p. On the way y from there its squared distance grows to
//! (c - p)^2 + 2 (c - p).y + y^2 at most, and that of another source, with its point q, to (c - q)^2 + 2 (c - q).y at
//! least, for it is convex; of a point to y^2 more. So the other one is nowhere nearer if (c - q)^2 - (c - p)^2 is more
//! than the largest 2 (q - p).y in the box, for triangles y^2 more. Sources that lie side by side have a short q - p: of
//! all that are about as far as the nearest, few are left.

use super::labelled_shapes::LabelledShapes;
use crate::grid::{Box3, Geometry};

/// A source that may be the nearest, and its label.
pub type Candidate = (u32, u32);

/// Distances are rounded: a source that is farther by no more than this part stays.
const ROUNDING: f64 = 1e-12;

/// A box in world coordinates.
#[derive(Clone, Copy, Debug)]
pub struct Around {
    /// Its middle.
    pub middle: [f64; 3],
    /// Half of its extent.
    pub half: [f64; 3],
}

impl Around {
    /// The box that the centres of voxels lie in; `voxels` holds one at least.
    #[must_use]
    pub fn centres(geometry: &Geometry, voxels: &Box3) -> Self {
        let (lo, hi) = (geometry.position(voxels.lo), geometry.position(voxels.hi.map(|v| v - 1)));
        Self {
            middle: std::array::from_fn(|a| f64::midpoint(lo[a], hi[a])),
            half: std::array::from_fn(|a| 0.5 * (hi[a] - lo[a])),
        }
    }

    /// The box between the centres of the voxels that are corners of cells, given by their lowest corners; a little larger,
    /// for places in it are rounded.
    #[must_use]
    pub fn cells(geometry: &Geometry, cells: &Box3) -> Self {
        let within = Self::centres(geometry, &Box3::new(cells.lo, cells.hi.map(|v| v + 1)));
        let larger = |a: usize| within.half[a] + 1e-6 * geometry.spacing[a];
        Self { half: std::array::from_fn(larger), ..within }
    }

    /// How near to some place in the box a source can be when the one nearest to the middle is at that squared distance.
    #[must_use]
    pub fn least(&self, nearest_squared: f64) -> f64 {
        let reach = self.half.iter().map(|h| h * h).sum::<f64>().sqrt();
        nearest_squared.sqrt() * (1.0 - ROUNDING) - reach
    }

    /// How far from the middle a source can be that is nearest to some place in the box, squared, when the one nearest to
    /// the middle is at that squared distance.
    #[must_use]
    pub fn limit(&self, nearest_squared: f64) -> f64 {
        let reach = self.half.iter().map(|h| h * h).sum::<f64>().sqrt();
        (nearest_squared.sqrt() + 2.0 * reach).powi(2) * (1.0 + ROUNDING)
    }
}

/// Work buffer: the closest point of each candidate and its squared distance.
#[derive(Clone, Debug, Default)]
pub struct Culling {
    closest: Vec<([f64; 3], f64)>,
}

impl Culling {
    /// Bytes of memory.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        (self.closest.capacity() * size_of::<([f64; 3], f64)>()) as u64
    }

    /// Appends those of the candidates from `first` on that can be the nearest of them to a place in a box. Returns how far the
    /// nearest is from the box's middle, squared; infinite where there is none.
    pub fn keep(
        &mut self,
        shapes: &LabelledShapes<'_>,
        around: &Around,
        candidates: &mut Vec<Candidate>,
        first: usize,
    ) -> f64 {
        let Around { middle, half } = *around;
        let squared = |point: [f64; 3]| (0..3).map(|a| (middle[a] - point[a]).powi(2)).sum::<f64>();
        self.closest.clear();
        self.closest.extend(candidates[first..].iter().map(|&(source, _)| {
            let point = shapes.closest(middle, source);
            (point, squared(point))
        }));
        let Some(&(nearest, least)) = self.closest.iter().min_by(|a, b| a.1.total_cmp(&b.1)) else {
            return f64::INFINITY;
        };
        let reach_squared = half.iter().map(|h| h * h).sum::<f64>();
        for (n, (point, squared)) in self.closest.iter().enumerate() {
            let candidate = candidates[first + n];
            let gain = 2.0 * (0..3).map(|a| (point[a] - nearest[a]).abs() * half[a]).sum::<f64>();
            let bend = if shapes.is_point(candidate.0) { 0.0 } else { reach_squared };
            if squared * (1.0 - ROUNDING) <= least + gain + bend {
                candidates.push(candidate);
            }
        }
        least
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{DataSets, TriangleMesh};
    use proptest::prelude::*;

    /// Five points, and five triangles.
    fn sets(positions: &[[f64; 3]]) -> DataSets {
        let mut sets = DataSets::default();
        sets.add_cloud(&positions[..5]);
        let triangles = (0..5).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
        sets.add_mesh(&TriangleMesh { vertices: positions[5..].to_vec(), triangles });
        sets
    }

    proptest! {
        #[test]
        fn what_is_nearest_somewhere_is_kept(
            positions in prop::collection::vec(prop::array::uniform3(-4.0..4.0_f64), 20),
            middle in prop::array::uniform3(-2.0..2.0_f64),
            half in prop::array::uniform3(0.0..2.0_f64),
            within in prop::collection::vec(prop::array::uniform3(-1.0..=1.0_f64), 50),
        ) {
            let sets = sets(&positions);
            let shapes = LabelledShapes::new(&sets);
            let all: Vec<Candidate> = (0..10).map(|source| (source, shapes.label(source))).collect();
            let mut candidates = all.clone();
            let around = Around { middle, half };
            let least = around.least(Culling::default().keep(&shapes, &around, &mut candidates, 0));
            let squared = |here, source| shapes.distance_squared(here, source);
            let nearest = |here: [f64; 3]| (0..10).min_by(|a, b| squared(here, *a).total_cmp(&squared(here, *b))).unwrap();
            let limit = around.limit(squared(middle, nearest(middle)));
            for part in within {
                let source = nearest(std::array::from_fn(|a| middle[a] + part[a] * half[a]));
                prop_assert!(candidates[10..].contains(&all[source as usize]), "{source} is missing");
                prop_assert!(squared(middle, source) <= limit);
                let here: [f64; 3] = std::array::from_fn(|a| middle[a] + part[a] * half[a]);
                prop_assert!(least <= squared(here, source).sqrt());
            }
        }
    }

    #[test]
    fn in_a_place_the_nearest_alone_is_left() {
        let positions: Vec<[f64; 3]> = (0..20).map(|n| [f64::from(n), 0.0, f64::from(n % 2)]).collect();
        let sets = sets(&positions);
        let shapes = LabelledShapes::new(&sets);
        let mut candidates: Vec<Candidate> = (0..10).map(|source| (source, shapes.label(source))).collect();
        Culling::default().keep(&shapes, &Around { middle: [2.1, 0.0, 0.0], half: [0.0; 3] }, &mut candidates, 0);
        assert_eq!(candidates[10..], [(2, 1)]);
    }
}
