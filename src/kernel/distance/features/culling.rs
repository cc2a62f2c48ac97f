//! Which of some sources can be the nearest to a place in a box.
//!
//! From a box's middle c let one source be nearest, at its point p. On the way y from there its squared distance grows to
//! (c - p)^2 + 2 (c - p).y + y^2 at most, and that of another source, with its point q, to (c - q)^2 + 2 (c - q).y at
//! least, for it is convex; of a point to y^2 more. So the other one is nowhere nearer if (c - q)^2 - (c - p)^2 is more
//! than the largest 2 (q - p).y in the box, for triangles y^2 more. Sources that lie side by side have a short q - p: of
//! all that are about as far as the nearest, few are left.

use super::labelled_shapes::LabelledShapes;
use crate::grid::{Box3, Geometry};
use crate::kernel::distance::state::source::squared_distance;

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

    /// How far, squared, a source can be from the middle that is nearest to some place in the box, by how far its point lies from that of
    /// another source, along each axis, which is `known` away.
    fn most(&self, known: f64, shapes: &LabelledShapes<'_>, source: u32, along: impl Fn(usize) -> f64) -> f64 {
        let gain = 2.0 * (0..3).map(|a| along(a) * self.half[a]).sum::<f64>();
        let bend = if shapes.is_point(source) { 0.0 } else { self.half.iter().map(|h| h * h).sum() };
        known + gain + bend
    }

    /// How far from the middle a source can be that is nearest to some place in the box, squared, when the one nearest to
    /// the middle is at that squared distance.
    #[must_use]
    pub fn limit(&self, nearest_squared: f64) -> f64 {
        let reach = self.half.iter().map(|h| h * h).sum::<f64>().sqrt();
        (nearest_squared.sqrt() + 2.0 * reach).powi(2) * (1.0 + ROUNDING)
    }
}

/// Triangles are told by balls around them, before their closest points are, from so many on.
const BALLS: usize = 12;
/// By these alone if their radius is no more than this part of half the box's diagonal.
const SMALL: f64 = 0.25;

/// What balls around triangles tell of them: one in a ball around m of radius r is |c - m| - r away at least, and |q - p| is |m - p| + r at
/// most along each axis. Of triangles that are small beside the box that is nearly all there is to tell.
struct Balls<'a> {
    shapes: &'a LabelledShapes<'a>,
    around: &'a Around,
    /// Half the box's diagonal.
    reach: f64,
    /// A point of a source that is near the middle, and its squared distance.
    known: ([f64; 3], f64),
}

impl<'a> Balls<'a> {
    /// None where asking is as fast.
    fn of(shapes: &'a LabelledShapes<'a>, around: &'a Around, candidates: &[Candidate]) -> Option<Self> {
        if candidates.len() < BALLS || shapes.is_point(candidates[0].0) {
            return None;
        }
        let point = shapes.closest(around.middle, about_nearest(shapes, around.middle, candidates)?);
        let reach = around.half.iter().map(|h| h * h).sum::<f64>().sqrt();
        Some(Self { shapes, around, reach, known: (point, squared_distance(around.middle, point)) })
    }

    /// Appends those of the candidates from `first` on that can be the nearest of them to a place in the box. Returns how far the nearest is from
    /// its middle at least, squared.
    fn keep(&self, candidates: &mut Vec<Candidate>, first: usize) -> f64 {
        let Self { shapes, around, reach, known: (known, known_squared) } = *self;
        let mut least = known_squared;
        for n in first..candidates.len() {
            let candidate = candidates[n];
            let (ball, radius) = shapes.ball(candidate.0);
            let away = away_at_least(around.middle, (ball, radius));
            least = least.min(away * away);
            let gain = |a: usize| (ball[a] - known[a]).abs() + radius;
            if away * away > around.most(known_squared, shapes, candidate.0, gain) {
                continue;
            }
            let is_kept = radius <= SMALL * reach || {
                let point = shapes.closest(around.middle, candidate.0);
                let gain = |a: usize| (point[a] - known[a]).abs();
                let squared = squared_distance(around.middle, point) * (1.0 - ROUNDING);
                squared <= around.most(known_squared, shapes, candidate.0, gain)
            };
            if is_kept {
                candidates.push(candidate);
            }
        }
        least
    }
}

/// How far a place is from what a ball holds, at least.
fn away_at_least(here: [f64; 3], (ball, radius): ([f64; 3], f64)) -> f64 {
    (squared_distance(here, ball).sqrt() * (1.0 - ROUNDING) - radius * (1.0 + ROUNDING)).max(0.0)
}

/// The source whose ball has the nearest middle.
fn about_nearest(shapes: &LabelledShapes<'_>, here: [f64; 3], candidates: &[Candidate]) -> Option<u32> {
    let away = |&(source, _): &Candidate| (source, squared_distance(here, shapes.ball(source).0));
    candidates.iter().map(away).reduce(|best, next| if next.1 < best.1 { next } else { best }).map(|(source, _)| source)
}

/// The squared distance, the label and the number of the nearest of some sources to a place; of equal ones the lower label, then the lower number.
#[must_use]
pub fn nearest_of(shapes: &LabelledShapes<'_>, here: [f64; 3], among: &[Candidate]) -> Option<(f64, u32, u32)> {
    let rank = |&(source, label): &Candidate| (shapes.distance_squared(here, source), label, source);
    let lower = |best: (f64, u32, u32), next: (f64, u32, u32)| if next < best { next } else { best };
    if among.len() < BALLS || shapes.is_point(among[0].0) {
        return among.iter().map(rank).reduce(lower);
    }
    let first = shapes.distance_squared(here, about_nearest(shapes, here, among)?);
    let mut best = (first, u32::MAX, u32::MAX);
    for candidate in among {
        let away = away_at_least(here, shapes.ball(candidate.0));
        if away * away * (1.0 - ROUNDING) <= best.0 {
            best = lower(best, rank(candidate));
        }
    }
    Some(best)
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
        if let Some(balls) = Balls::of(shapes, around, &candidates[first..]) {
            return balls.keep(candidates, first);
        }
        let middle = around.middle;
        self.closest.clear();
        self.closest.extend(candidates[first..].iter().map(|&(source, _)| {
            let point = shapes.closest(middle, source);
            (point, squared_distance(middle, point))
        }));
        let Some(&(nearest, least)) = self.closest.iter().min_by(|a, b| a.1.total_cmp(&b.1)) else {
            return f64::INFINITY;
        };
        for (n, (point, squared)) in self.closest.iter().enumerate() {
            let candidate = candidates[first + n];
            if squared * (1.0 - ROUNDING) <= around.most(least, shapes, candidate.0, |a| (point[a] - nearest[a]).abs())
            {
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
