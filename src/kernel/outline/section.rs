//! What an object covers in one plane: closed polygons, filled by the even-odd rule, and the signed distance to their
//! border, negative inside. An outline inside another is a hole, one beside another a branch.
//!
//! Edges lie in square buckets, so that a query looks at a few of them: those near the point for its distance, those of
//! its row for its side.

use super::curve::{Curve, area};
use super::plane::Plane;

/// The outlines of an object in one plane.
#[derive(Clone, Debug)]
pub struct Section {
    /// Where they lie.
    pub plane: Plane,
    /// Closed polygons in the plane's coordinates.
    pub curves: Vec<Curve>,
    /// The marks that the curves go through, world positions.
    pub marks: Vec<[f64; 3]>,
    buckets: Buckets,
}

/// Edges by square; `[first, second]` ends of each.
#[derive(Clone, Debug)]
struct Buckets {
    edges: Vec<[[f64; 2]; 2]>,
    low: [f64; 2],
    size: f64,
    counts: [usize; 2],
    squares: Vec<Vec<u32>>,
    rows: Vec<Vec<u32>>,
}

/// Buckets along the longer side.
const MOST_BUCKETS: f64 = 64.0;

impl Section {
    /// The section that curves bound, which go through marks.
    #[must_use]
    pub fn new(plane: Plane, curves: Vec<Curve>, marks: Vec<[f64; 3]>) -> Self {
        let buckets = Buckets::new(&curves);
        Self { plane, curves, marks, buckets }
    }

    /// The signed distance to the border.
    #[must_use]
    pub fn distance(&self, point: [f64; 2]) -> f64 {
        self.distance_within(point, f64::INFINITY)
    }

    /// The same where it is at most `limit`; beyond it `limit`, with the sign of the side.
    #[must_use]
    pub fn distance_within(&self, point: [f64; 2], limit: f64) -> f64 {
        let distance = self.buckets.distance(point, limit);
        if self.buckets.holds(point) { -distance } else { distance }
    }

    /// True inside.
    #[must_use]
    pub fn holds(&self, point: [f64; 2]) -> bool {
        self.buckets.holds(point)
    }

    /// The radius of the circle that covers as much as the largest outline.
    #[must_use]
    pub fn radius(&self) -> f64 {
        let largest = self.curves.iter().map(|curve| area(&curve.points).abs()).fold(0.0, f64::max);
        (largest / std::f64::consts::PI).sqrt()
    }

    /// The lowest and highest coordinates.
    #[must_use]
    pub fn bounds(&self) -> [[f64; 2]; 2] {
        bounds(self.curves.iter().flat_map(|curve| &curve.points))
    }

    /// The point farthest from the border on the inside, of a lattice of them, with its depth; none where no point of
    /// it is inside.
    #[must_use]
    pub fn deepest(&self) -> Option<([f64; 2], f64)> {
        const STEPS: usize = 24;
        let [low, high] = self.bounds();
        let at = |n: usize, a: usize| low[a] + (high[a] - low[a]) * (n as f64 + 0.5) / STEPS as f64;
        let points = (0..STEPS).flat_map(|j| (0..STEPS).map(move |i| [at(i, 0), at(j, 1)]));
        points.map(|p| (p, -self.distance(p))).filter(|(_, depth)| *depth > 0.0).max_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// The widest distance between neighbouring sections of one direction, which come one after the other; 0 where none is
/// parallel to the one before it.
#[must_use]
pub fn widest_gap<S: std::borrow::Borrow<Section>>(sections: &[S]) -> f64 {
    let planes = sections.windows(2).map(|pair| [&pair[0].borrow().plane, &pair[1].borrow().plane]);
    let gaps = planes.filter(|[a, b]| a.is_parallel_to(b)).map(|[a, b]| (b.offset - a.offset).abs());
    gaps.fold(0.0, f64::max)
}

fn bounds<'a>(points: impl Iterator<Item = &'a [f64; 2]>) -> [[f64; 2]; 2] {
    points.fold([[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]], |[low, high], p| {
        [std::array::from_fn(|a| low[a].min(p[a])), std::array::from_fn(|a| high[a].max(p[a]))]
    })
}

impl Buckets {
    fn new(curves: &[Curve]) -> Self {
        let [low, high] = bounds(curves.iter().flat_map(|curve| &curve.points));
        let longest = (high[0] - low[0]).max(high[1] - low[1]).max(f64::MIN_POSITIVE);
        let size = longest / MOST_BUCKETS;
        let counts = [0, 1].map(|a| ((high[a] - low[a]) / size) as usize + 1);
        let mut buckets = Self {
            edges: Vec::new(),
            low,
            size,
            counts,
            squares: vec![Vec::new(); counts[0] * counts[1]],
            rows: vec![Vec::new(); counts[1]],
        };
        for curve in curves {
            for (n, &from) in curve.points.iter().enumerate() {
                buckets.add([from, curve.points[(n + 1) % curve.points.len()]]);
            }
        }
        buckets
    }

    fn add(&mut self, edge: [[f64; 2]; 2]) {
        let number = self.edges.len() as u32;
        let first = self.bucket([edge[0][0].min(edge[1][0]), edge[0][1].min(edge[1][1])]);
        let last = self.bucket([edge[0][0].max(edge[1][0]), edge[0][1].max(edge[1][1])]);
        for j in first[1]..=last[1] {
            self.rows[j].push(number);
            for i in first[0]..=last[0] {
                self.squares[j * self.counts[0] + i].push(number);
            }
        }
        self.edges.push(edge);
    }

    /// The bucket of a point, or the one nearest to it.
    fn bucket(&self, point: [f64; 2]) -> [usize; 2] {
        [0, 1].map(|a| (((point[a] - self.low[a]) / self.size).max(0.0) as usize).min(self.counts[a] - 1))
    }

    /// The distance to the nearest edge, or `limit`: rings of buckets until none that is left can hold a nearer one.
    fn distance(&self, point: [f64; 2], limit: f64) -> f64 {
        let [i, j] = self.bucket(point);
        let centre = [i, j].map(|n| n as i64);
        // How far the point lies outside of its bucket's square, at most.
        let beyond = (0..2).map(|a| {
            let low = self.low[a] + centre[a] as f64 * self.size;
            (low - point[a]).max(point[a] - low - self.size).max(0.0)
        });
        let beyond = beyond.fold(0.0, f64::max);
        let mut nearest = limit * limit;
        for ring in 0..=self.counts[0].max(self.counts[1]) as i64 {
            if nearest <= ((ring - 1) as f64 * self.size - beyond).max(0.0).powi(2) && ring > 0 {
                break;
            }
            for square in self.ring(centre, ring) {
                for &edge in square {
                    nearest = nearest.min(distance_squared(self.edges[edge as usize], point));
                }
            }
        }
        nearest.sqrt().min(limit)
    }

    /// The buckets of a square ring.
    fn ring(&self, [i, j]: [i64; 2], ring: i64) -> impl Iterator<Item = &Vec<u32>> {
        let counts = self.counts.map(|n| n as i64);
        let rows = (j - ring).max(0)..=(j + ring).min(counts[1] - 1);
        rows.flat_map(move |row| {
            let step = if (row - j).abs() == ring || ring == 0 { 1 } else { 2 * ring };
            (i - ring..=i + ring)
                .step_by(step as usize)
                .filter(move |n| (0..counts[0]).contains(n))
                .map(move |n| (n, row))
        })
        .map(move |(n, row)| &self.squares[(row * counts[0] + n) as usize])
    }

    fn holds(&self, point: [f64; 2]) -> bool {
        let [_, j] = self.bucket(point);
        let row = &self.rows[j];
        let crossings = row.iter().filter(|&&edge| {
            let [a, b] = self.edges[edge as usize];
            (a[1] <= point[1]) != (b[1] <= point[1])
                && a[0] + (point[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) > point[0]
        });
        crossings.count() % 2 == 1
    }
}

fn distance_squared([a, b]: [[f64; 2]; 2], p: [f64; 2]) -> f64 {
    let (along, to) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let length = along[0] * along[0] + along[1] * along[1];
    let share = if length > 0.0 { ((to[0] * along[0] + to[1] * along[1]) / length).clamp(0.0, 1.0) } else { 0.0 };
    (to[0] - share * along[0]).powi(2) + (to[1] - share * along[1]).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(low: f64, high: f64) -> Curve {
        Curve { points: vec![[low, low], [high, low], [high, high], [low, high]], deviation: 0.0 }
    }

    #[test]
    fn distances_and_sides_of_a_square_with_a_hole() {
        let plane = Plane::of(&[[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]], [0.1; 3]).unwrap();
        let section = Section::new(plane, vec![square(0.0, 10.0), square(4.0, 6.0)], Vec::new());
        let slow = |p: [f64; 2]| {
            let edges = section.curves.iter().flat_map(|c| (0..4).map(|n| [c.points[n], c.points[(n + 1) % 4]]));
            edges.map(|edge| distance_squared(edge, p)).fold(f64::INFINITY, f64::min).sqrt()
        };
        for j in -9..30 {
            for i in -9..30 {
                let p = [f64::from(i) * 0.531, f64::from(j) * 0.477];
                let inside = |low: f64, high: f64| p.iter().all(|v| (low..high).contains(v));
                let sign = if inside(0.0, 10.0) && !inside(4.0, 6.0) { -1.0 } else { 1.0 };
                assert!((section.distance(p) - sign * slow(p)).abs() < 1e-12, "{p:?}");
            }
        }
        assert!((section.radius() - (100.0f64 / std::f64::consts::PI).sqrt()).abs() < 1e-12);
        assert!((section.deepest().unwrap().1 - 2.3).abs() < 0.3, "{:?}", section.deepest());
    }
}
