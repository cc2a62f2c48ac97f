//! What an object covers in one plane: closed polygons, and the signed distance to their border, negative inside. What a
//! polygon runs around is inside of it, however often it does; what is inside of an even number of them is a hole: an
//! outline inside another is one, one beside another is a branch.
//!
//! Square buckets know the edges that can be nearest to their points, told level by level from those of the square that
//! was divided into them; rows of buckets know the edges that cross them, which tell a point's side.

use super::chords::chords;
use super::curve::Curve;
use super::marked::area;
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

/// Edges by place; `[first, second]` ends of each.
#[derive(Clone, Debug)]
struct Buckets {
    edges: Vec<[[f64; 2]; 2]>,
    /// The lowest corner of the square that is divided, and the side of a bucket of it.
    low: [f64; 2],
    size: f64,
    /// Buckets along a side.
    side: usize,
    /// By bucket where the edges that can be nearest to a point of it start in `nearest`, which has them as runs from
    /// one edge up to another.
    starts: Vec<u32>,
    nearest: Vec<Run>,
    /// By row of buckets the edges that cross it, in order.
    rows: Vec<Vec<u32>>,
    /// Where each curve's edges end.
    ends: Vec<u32>,
}

/// Edges one after the other.
type Run = [u32; 2];

/// Edges for each bucket along a side, about, and the most of these, a power of two.
const EDGES_ALONG: usize = 8;
const MOST_ALONG: usize = 64;

impl Section {
    /// The section that curves bound, which go through marks; distances may be off by `within`.
    #[must_use]
    pub fn new(plane: Plane, curves: Vec<Curve>, marks: Vec<[f64; 3]>, within: f64) -> Self {
        let buckets = Buckets::new(&curves, within);
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
    fn new(curves: &[Curve], within: f64) -> Self {
        let (mut edges, mut ends) = (Vec::new(), Vec::new());
        for curve in curves {
            let corners = chords(&curve.points, within);
            edges.extend((0..corners.len()).map(|n| [corners[n], corners[(n + 1) % corners.len()]]));
            ends.push(edges.len() as u32);
        }
        let [low, high] = bounds(curves.iter().flat_map(|curve| &curve.points));
        let longest = (high[0] - low[0]).max(high[1] - low[1]).max(f64::MIN_POSITIVE);
        // Twice as long as the outlines: most of what is asked for lies beside them.
        let whole = Square { centre: [0, 1].map(|a| 0.5 * (low[a] + high[a])), half: longest };
        let side = (edges.len() / EDGES_ALONG).clamp(1, MOST_ALONG).next_power_of_two();
        let size = 2.0 * whole.half / side as f64;
        let low = whole.centre.map(|c| c - whole.half);
        let mut buckets = Self {
            edges,
            low,
            size,
            side,
            starts: Vec::new(),
            nearest: Vec::new(),
            rows: vec![Vec::new(); side],
            ends,
        };
        buckets.divide(whole);
        for (number, edge) in buckets.edges.iter().enumerate() {
            let rows = [edge[0], edge[1]].map(|end| buckets.row(end[1]));
            (rows[0].min(rows[1])..=rows[0].max(rows[1])).for_each(|row| buckets.rows[row].push(number as u32));
        }
        buckets
    }

    /// Finds the edges that can be nearest to points of each bucket.
    fn divide(&mut self, whole: Square) {
        let mut squares = vec![(whole, vec![[0, self.edges.len() as u32]])];
        let mut side = 1;
        while side < self.side {
            let mut divided = Vec::with_capacity(4 * squares.len());
            for j in 0..2 * side {
                for i in 0..2 * side {
                    let (of, edges) = &squares[j / 2 * side + i / 2];
                    let part = of.part([i % 2, j % 2]);
                    divided.push((part, part.nearest(&self.edges, edges)));
                }
            }
            (squares, side) = (divided, 2 * side);
        }
        self.starts = Vec::with_capacity(squares.len() + 1);
        for (_, edges) in squares {
            self.starts.push(self.nearest.len() as u32);
            self.nearest.extend(edges);
        }
        self.starts.push(self.nearest.len() as u32);
    }

    fn nearest_squared(&self, [from, to]: Run, point: [f64; 2]) -> f64 {
        let edges = &self.edges[from as usize..to as usize];
        edges.iter().map(|&edge| distance_squared(edge, point)).fold(f64::INFINITY, f64::min)
    }

    fn row(&self, y: f64) -> usize {
        (((y - self.low[1]) / self.size).max(0.0) as usize).min(self.side - 1)
    }

    /// The distance to the nearest edge, or `limit`.
    fn distance(&self, point: [f64; 2], limit: f64) -> f64 {
        let [i, j] = [0, 1].map(|a| ((point[a] - self.low[a]) / self.size).floor());
        let inside = 0.0..self.side as f64;
        let squared = if inside.contains(&i) && inside.contains(&j) {
            let bucket = j as usize * self.side + i as usize;
            let runs = &self.nearest[self.starts[bucket] as usize..self.starts[bucket + 1] as usize];
            runs.iter().map(|&run| self.nearest_squared(run, point)).fold(f64::INFINITY, f64::min)
        } else {
            self.nearest_squared([0, self.edges.len() as u32], point)
        };
        squared.sqrt().min(limit)
    }

    fn holds(&self, point: [f64; 2]) -> bool {
        let row = &self.rows[self.row(point[1])];
        let (mut curve, mut turns, mut holding) = (0, 0, false);
        for &edge in row {
            while edge >= self.ends[curve] {
                (curve, holding, turns) = (curve + 1, holding != (turns != 0), 0);
            }
            let [a, b] = self.edges[edge as usize];
            let crosses = (a[1] <= point[1]) != (b[1] <= point[1]);
            if crosses && a[0] + (point[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) > point[0] {
                turns += if a[1] <= point[1] { 1 } else { -1 };
            }
        }
        holding != (turns != 0)
    }
}

/// A square of the plane.
#[derive(Clone, Copy)]
struct Square {
    centre: [f64; 2],
    half: f64,
}

impl Square {
    fn part(&self, corner: [usize; 2]) -> Self {
        let half = 0.5 * self.half;
        let centre = std::array::from_fn(|a| self.centre[a] + if corner[a] == 1 { half } else { -half });
        Self { centre, half }
    }

    /// Those of the edges that can be nearest to a point of the square: a point is no farther from its nearest edge than
    /// the centre from its own, and what lies between both.
    fn nearest(&self, edges: &[[[f64; 2]; 2]], among: &[Run]) -> Vec<Run> {
        let numbers = || among.iter().flat_map(|&[from, to]| from..to);
        let away: Vec<f64> = numbers().map(|edge| distance_squared(edges[edge as usize], self.centre)).collect();
        let least = away.iter().copied().fold(f64::INFINITY, f64::min).sqrt();
        // Twice half the diagonal, and a little for rounding.
        let most = least + 2.0 * self.half * std::f64::consts::SQRT_2 * (1.0 + 1e-9);
        let mut runs: Vec<Run> = Vec::new();
        for (edge, _) in numbers().zip(away).filter(|(_, away)| *away <= most * most) {
            match runs.last_mut().filter(|run| run[1] == edge) {
                Some(run) => run[1] = edge + 1,
                None => runs.push([edge, edge + 1]),
            }
        }
        runs
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
        let section = Section::new(plane, vec![square(0.0, 10.0), square(4.0, 6.0)], Vec::new(), 1e-9);
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
        let twice = |points: Vec<[f64; 2]>| Curve { points: [points.clone(), points].concat(), deviation: 0.0 };
        let around = Section::new(plane, vec![twice(square(0.0, 10.0).points)], Vec::new(), 1e-9);
        assert!(around.distance([5.0, 5.0]) == -5.0 && around.distance([12.0, 5.0]) == 2.0, "twice around");
        assert!((section.radius() - (100.0f64 / std::f64::consts::PI).sqrt()).abs() < 1e-12);
        assert!((section.deepest().unwrap().1 - 2.3).abs() < 0.3, "{:?}", section.deepest());
    }
}
