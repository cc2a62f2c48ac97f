//! What distances are on a grid that sources lie outside of, and what the methods' own rules leave there: plain searches
//! over all sources and all voxels in f64, nothing shared with the program (docs/algorithms.md, "Outside of the grid",
//! "Upwind solution", "Vector distance transform", "Dijkstra-Pythagoras").
//!
//! No bound here is a figure that runs once gave. A voxel is fixed or it is not. A fixed one has the distance that the
//! documentation gives it. One that is not solves the method's equation with what its neighbours hold; as that equation has
//! one solution for given fixed voxels, nothing else can be held.

use strandline::grid::{DataSets, Geometry};

use super::lab::PlainGrid;
use super::textbook::{godunov, position, squared};

/// A stored distance has the 24 bits of f32; squares and roots in f64 add nothing to that.
const ROUNDING: f64 = f32::EPSILON as f64;

/// An update in f32 rounds a dozen times, terms that are not larger than the spacing times the squared ratio of spacings;
/// then its sum with the smallest neighbour is rounded once.
const ROUNDINGS_OF_AN_UPDATE: f64 = 16.0;

fn along(a: [f64; 3], b: [f64; 3], t: f64) -> [f64; 3] {
    std::array::from_fn(|i| a[i] + t * (b[i] - a[i]))
}

/// The place of a segment that is nearest.
fn place_on_segment(p: [f64; 3], a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    let dot: f64 = (0..3).map(|i| (p[i] - a[i]) * (b[i] - a[i])).sum();
    along(a, b, (dot / squared(a, b)).clamp(0.0, 1.0))
}

/// The place of a triangle that is nearest: the foot on its plane where that lies inside, else one of the nearest side.
pub(crate) fn place_on_triangle(p: [f64; 3], [a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    let sub = |p: [f64; 3], q: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| p[i] - q[i]) };
    let cross = |u: [f64; 3], v: [f64; 3]| -> [f64; 3] {
        [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    };
    let dot = |u: [f64; 3], v: [f64; 3]| u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
    let normal = cross(sub(b, a), sub(c, a));
    let left = |from: [f64; 3], to: [f64; 3]| dot(cross(sub(to, from), sub(p, from)), normal) >= 0.0;
    if left(a, b) && left(b, c) && left(c, a) {
        let high = dot(sub(p, a), normal) / dot(normal, normal);
        return std::array::from_fn(|i| p[i] - high * normal[i]);
    }
    let sides = [(a, b), (b, c), (c, a)].map(|(from, to)| place_on_segment(p, from, to));
    sides.into_iter().reduce(|near, place| if squared(p, place) < squared(p, near) { place } else { near }).unwrap_or(a)
}

/// The distance to a triangle.
pub(crate) fn to_triangle(p: [f64; 3], triangle: [[f64; 3]; 3]) -> f64 {
    squared(p, place_on_triangle(p, triangle)).sqrt()
}

/// Whether a triangle meets a box: what is left of it once all beyond each of the six sides is cut off.
fn meets_box(triangle: [[f64; 3]; 3], lo: [f64; 3], hi: [f64; 3]) -> bool {
    let mut left = triangle.to_vec();
    for axis in 0..3 {
        for (side, sign) in [(lo[axis], 1.0), (hi[axis], -1.0)] {
            let within = |p: [f64; 3]| sign * (p[axis] - side);
            let mut kept = Vec::new();
            for (n, &from) in left.iter().enumerate() {
                let to = left[(n + 1) % left.len()];
                let (here, there) = (within(from), within(to));
                if here >= 0.0 {
                    kept.push(from);
                }
                if (here >= 0.0) != (there >= 0.0) {
                    kept.push(along(from, to, here / (here - there)));
                }
            }
            left = kept;
        }
    }
    !left.is_empty()
}

/// What is true of a voxel, by a search over all sources.
struct Truth {
    /// The distance to the nearest source.
    exact: f64,
    /// Whether the nearest place lies outside of the grid.
    is_outside: bool,
    /// The distance to the nearest source that lies in or cuts one of the eight cells around, if one does.
    beside: Option<f64>,
    /// How far the voxel is from the outermost layer.
    depth: f64,
}

impl Truth {
    /// The distance that the voxel is fixed at, if it is, where fixed voxels alone know of a source at first.
    fn fixed(&self) -> Option<f64> {
        let is_seen = self.depth == 0.0 || self.beside.is_some();
        if self.is_outside && is_seen { Some(self.exact) } else { self.beside }
    }
}

/// A grid, sources in it and outside, and what is true of each voxel.
pub(crate) struct Around<'a> {
    grid: &'a Geometry,
    sets: &'a DataSets,
    voxels: Vec<[i64; 3]>,
    truths: Vec<Truth>,
}

/// From which of its 26 neighbours a voxel takes its source where distances solve the upwind equation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Parent {
    /// The one at the sum of offsets of smaller neighbours that entered its solution, or one of these (FSM, Alg. 7).
    UpwindSum,
    /// The one that gives the shortest way (FMM, Alg. 8).
    ShortestWay,
}

/// What is asked of neighbours whose sources are compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Rest {
    /// No neighbour of a voxel has a source that is nearer to it: sweeps until nothing changes.
    OfSweeps,
    /// Of two neighbours the one that was frozen later has seen the other's: one heap, in which nothing is looked at again.
    OfHeap,
}

impl<'a> Around<'a> {
    pub(crate) fn new(grid: &'a Geometry, sets: &'a DataSets) -> Self {
        let plain = PlainGrid { shape: grid.shape };
        let mut around = Self { grid, sets, voxels: plain.voxels().collect(), truths: Vec::new() };
        around.truths = around.voxels.iter().map(|&v| around.truth(v)).collect();
        around
    }

    fn places(&self) -> PlainGrid {
        PlainGrid { shape: self.grid.shape }
    }

    /// The place of a source that is nearest.
    fn place(&self, here: [f64; 3], source: u32) -> [f64; 3] {
        let (points, n) = (&self.sets.positions, source as usize);
        points.get(n).copied().unwrap_or_else(|| place_on_triangle(here, self.sets.mesh.corners(n - points.len())))
    }

    /// The distance to a source.
    pub(crate) fn to_source(&self, v: [i64; 3], source: u32) -> f64 {
        let here = position(self.grid, v);
        squared(here, self.place(here, source)).sqrt()
    }

    fn is_outside(&self, place: [f64; 3]) -> bool {
        let grid = self.grid;
        let last = |a: usize| (grid.shape[a] - 1) as f64 * grid.spacing[a];
        (0..3).any(|a| place[a] < grid.origin[a] || place[a] - grid.origin[a] > last(a))
    }

    fn reaches_out(&self, source: u32) -> bool {
        let (points, n) = (&self.sets.positions, source as usize);
        let corners = || self.sets.mesh.corners(n - points.len()).into_iter().any(|corner| self.is_outside(corner));
        points.get(n).map_or_else(corners, |&point| self.is_outside(point))
    }

    /// Whether a source lies in or cuts one of the eight cells around a voxel.
    fn is_beside(&self, v: [i64; 3], source: u32) -> bool {
        let (grid, points, n) = (self.grid, &self.sets.positions, source as usize);
        points.get(n).map_or_else(
            || {
                let side = |sign: f64| std::array::from_fn(|a| position(grid, v)[a] + sign * grid.spacing[a]);
                meets_box(self.sets.mesh.corners(n - points.len()), side(-1.0), side(1.0))
            },
            |point| {
                let cell = |a: usize| ((point[a] - grid.origin[a]) / grid.spacing[a]).floor() as i64;
                (0..3).all(|a| v[a] == cell(a) || v[a] == cell(a) + 1)
            },
        )
    }

    fn truth(&self, v: [i64; 3]) -> Truth {
        let (grid, here) = (self.grid, position(self.grid, v));
        let diagonal = squared(grid.spacing, [0.0; 3]).sqrt();
        let (mut exact, mut is_outside, mut beside) = (f64::INFINITY, false, None);
        for source in 0..self.sets.len() as u32 {
            let place = self.place(here, source);
            let far = squared(here, place).sqrt();
            if far < exact {
                (exact, is_outside) = (far, self.is_outside(place));
            }
            if far < beside.unwrap_or(f64::INFINITY) && far <= diagonal * 1.001 && self.is_beside(v, source) {
                beside = Some(far);
            }
        }
        let along = |a: usize| v[a].min(grid.shape[a] - 1 - v[a]) as f64 * grid.spacing[a];
        Truth { exact, is_outside, beside, depth: along(0).min(along(1)).min(along(2)) }
    }

    /// The least distance of all, for each voxel.
    pub(crate) fn exact(&self) -> impl Iterator<Item = f64> + '_ {
        self.truths.iter().map(|truth| truth.exact)
    }

    fn told(&self, at: usize, value: f64, what: &str) -> String {
        let Truth { exact, is_outside, beside, depth } = self.truths[at];
        format!(
            "{:?}: {value} {what}; the nearest of all is {exact} away, outside: {is_outside}; the nearest beside {beside:?}, \
             the outermost layer {depth}",
            self.voxels[at]
        )
    }

    /// Every voxel has the distance of the nearest source.
    pub(crate) fn is_exact(&self, values: &[f64]) -> Result<(), String> {
        for (at, (&value, exact)) in values.iter().zip(self.exact()).enumerate() {
            if (value - exact).abs() > exact * ROUNDING {
                return Err(self.told(at, value, "is not exact"));
            }
        }
        Ok(())
    }

    /// Fixed voxels have the distance that they are fixed at; all others solve the upwind equation with what their
    /// neighbours hold.
    pub(crate) fn solves_upwind(&self, values: &[f64]) -> Result<(), String> {
        let ([hx, hy, hz], places) = (self.grid.spacing, self.places());
        let (most, least) = (hx.max(hy).max(hz), hx.min(hy).min(hz));
        let of_update = ROUNDINGS_OF_AN_UPDATE * most * (most / least).powi(2);
        for (at, (&v, &value)) in self.voxels.iter().zip(values).enumerate() {
            let fixed = self.truths[at].fixed();
            let (expected, rounding, what) = fixed.map_or_else(
                || {
                    let held = |q| if places.contains(q) { values[places.at(q)] } else { f64::INFINITY };
                    let [xl, xu, yl, yu, zl, zu] = PlainGrid::around(v).map(held);
                    let x = godunov([xl.min(xu), yl.min(yu), zl.min(zu)], self.grid.spacing);
                    (x, ROUNDING * (x + of_update), "is what its neighbours make")
                },
                |fixed| (fixed, ROUNDING * fixed, "is what it is fixed at"),
            );
            // Not at all where it is no number.
            if (value - expected).abs() <= rounding {
                continue;
            }
            return Err(self.told(at, value, &format!("where {expected} {what}")));
        }
        Ok(())
    }

    /// Sources of distances that solve the upwind equation: a fixed voxel has one at its distance, every other that of a
    /// voxel that its method's rule may name. Where two are as good either will do.
    pub(crate) fn takes_sources(&self, values: &[f64], sources: &[u32], parent: Parent) -> Result<(), String> {
        for (at, (&v, &value)) in self.voxels.iter().zip(values).enumerate() {
            let is_right = self.truths[at].fixed().map_or_else(
                || self.parents(v, values, parent).any(|q| sources[q] == sources[at]),
                |fixed| (self.to_source(v, sources[at]) - fixed).abs() <= ROUNDING * fixed,
            );
            if !is_right {
                return Err(self.told(at, value, &format!("has source {}, which no parent has", sources[at])));
            }
        }
        Ok(())
    }

    /// The places of the voxels that a voxel may take its source from.
    fn parents<'b>(&'b self, v: [i64; 3], values: &'b [f64], parent: Parent) -> impl Iterator<Item = usize> + 'b {
        let places = self.places();
        let value = values[places.at(v)];
        let held = move |q| if places.contains(q) { values[places.at(q)] } else { f64::INFINITY };
        let way = move |step: [i64; 3]| {
            let length: f64 = (0..3).map(|a| (step[a] as f64 * self.grid.spacing[a]).powi(2)).sum();
            held(std::array::from_fn(|a| v[a] + step[a])) + length.sqrt()
        };
        let steps =
            || PlainGrid { shape: [3; 3] }.voxels().map(|step| step.map(|n| n - 1)).filter(|step| *step != [0; 3]);
        let shortest = steps().map(way).fold(f64::INFINITY, f64::min);
        let enters = move |step: [i64; 3], a: usize| {
            let beside = |sign: i64| held(std::array::from_fn(|b| if a == b { v[b] + sign * step[b] } else { v[b] }));
            step[a] == 0 || (beside(1) < value && beside(1) <= beside(-1))
        };
        let is_one = move |step: &[i64; 3]| match parent {
            Parent::UpwindSum => (0..3).all(|a| enters(*step, a)),
            Parent::ShortestWay => way(*step) <= shortest * (1.0 + ROUNDING),
        };
        let at = move |step: [i64; 3]| -> [i64; 3] { std::array::from_fn(|a| v[a] + step[a]) };
        steps()
            .filter(is_one)
            .map(at)
            .filter(move |q| places.contains(*q) && held(*q) <= value)
            .map(move |q| places.at(q))
    }

    /// Distances to sources that were handed on: each is that to its source. Where the nearest place of all lies outside it
    /// is the least of all; a fixed voxel has none that is farther than what it is fixed at; and others have the best of
    /// what their neighbours hold.
    pub(crate) fn keeps_the_best(&self, values: &[f64], sources: &[u32], rest: Rest) -> Result<(), String> {
        for (at, (&v, &value)) in self.voxels.iter().zip(values).enumerate() {
            let truth = &self.truths[at];
            let rounding = ROUNDING * value;
            let own = self.to_source(v, sources[at]);
            if (value - own).abs() > rounding {
                return Err(self.told(at, value, &format!("is not the {own} of source {}", sources[at])));
            }
            let allowed = if truth.is_outside { truth.exact } else { truth.fixed().unwrap_or(f64::INFINITY) };
            if value < truth.exact - rounding || value > allowed + rounding {
                return Err(self.told(at, value, &format!("is farther than {allowed}, or too near")));
            }
            if truth.fixed().is_some() {
                continue;
            }
            if let Some(better) = self.better_beside(at, values, sources, rest) {
                return Err(self.told(at, value, &format!("where a neighbour holds source {better}, which is nearer")));
            }
        }
        Ok(())
    }

    /// A source that a neighbour holds and that the voxel should have taken.
    fn better_beside(&self, at: usize, values: &[f64], sources: &[u32], rest: Rest) -> Option<u32> {
        let (v, places) = (self.voxels[at], self.places());
        let betters = |q: [i64; 3], of: u32| {
            let (held, depth) = (values[places.at(q)], self.truths[places.at(q)].depth);
            // Of what reaches out of the grid and was looked up last, voxels nearer to their own than to a face hear nothing.
            let is_heard = held >= depth || !self.reaches_out(of);
            is_heard && self.to_source(q, of) < held * (1.0 - ROUNDING)
        };
        let beside = PlainGrid::around(v).into_iter().filter(|q| places.contains(*q));
        let is_missed = |q: &[i64; 3]| {
            let is_free = self.truths[places.at(*q)].fixed().is_none();
            let had_to = rest == Rest::OfSweeps || (is_free && betters(*q, sources[at]));
            had_to && betters(v, sources[places.at(*q)])
        };
        beside.into_iter().find(is_missed).map(|q| sources[places.at(q)])
    }
}
