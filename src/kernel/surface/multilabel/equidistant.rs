//! Where the surface between labels passes between neighbouring corners: the place that is equally far from the nearest
//! sources of each label (docs/algorithms.md, "Surface between labels").
//!
//! Near the place are the sources that the voxels of a label track, one voxel around; with them the place is found, the
//! nearest source of each label is looked up there, and it is found again if one of these is new.
//! On an edge the difference of two exact distances is brought to zero (regula falsi, Illinois); in a triangle of three
//! labels and a tetrahedron of four all of them are made equal by Newton's method.

use glam::DVec3;

use super::corner::Corner;
use super::known::Known;
use crate::grid::Box3;
use crate::kernel::geometry::vector::{solved, unit};

/// How close to a voxel centre a vertex may come, in parts of the edge: triangles keep an area.
const MARGIN: f64 = 1.0 / 1024.0;
/// The same within triangles and tetrahedra, as the least weight of a corner.
const LEAST_WEIGHT: f64 = 1.0 / 256.0;
/// Steps of the search along an edge at most; three or four are usual.
const STEPS: usize = 12;
/// Halvings of a step that leads away from the place.
const HALVINGS: i32 = 5;
/// Sources of a label that are kept.
const KEPT: usize = 4;
/// How often a place is found at most, with what was looked up at the last.
const LOOKUPS: usize = 6;
/// A place that moves by less, in parts of the edge, has the sources that were looked up where it was before: they are
/// off by the square of that.
const SETTLED: f64 = 0.02;
/// A step, in weights, over which slopes are told.
const SMALL_STEP: f64 = 1e-4;
/// A difference of distances that counts as none, in parts of the edge.
const RESOLUTION: f64 = 1e-7;

/// A place between labels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Between {
    /// Voxel units of the domain, `[x, y, z]`.
    pub position: [f64; 3],
    /// Distance to the nearest sources of each label there, physical.
    pub distance: f64,
    /// The direction across the surface, towards the side of the larger label, of unit length, on an edge; else 0.
    /// Physical.
    pub normal: DVec3,
}

/// Work buffers: the sources of each label around.
#[derive(Clone, Debug, Default)]
pub(crate) struct Candidates {
    of_label: [Vec<u32>; 4],
}

impl Candidates {
    /// The place between two corners of different labels, and the distance there.
    pub(crate) fn on_edge(&mut self, known: &Known<'_>, corners: [Corner; 2]) -> Between {
        self.gather(known, &corners);
        let labels = corners.map(|corner| corner.label);
        let [from, to] = corners.map(|corner| corner.place);
        let place = |t: f64| -> [f64; 3] { std::array::from_fn(|a| from[a] + t * (to[a] - from[a])) };
        let ends = [from, to].map(|place| known.world(place));
        let length = DVec3::from(ends[0]).distance(ends[1].into());
        let (mut t, mut last) = (0.5, f64::INFINITY);
        for n in 1..=LOOKUPS {
            let difference = |t: f64| {
                let here = known.world(place(t));
                self.distance(known, 0, here) - self.distance(known, 1, here)
            };
            t = root(difference, RESOLUTION * length).clamp(MARGIN, 1.0 - MARGIN);
            if n == LOOKUPS || (t - last).abs() < SETTLED || !self.search_nearest(known, &labels, place(t)) {
                break;
            }
            last = t;
        }
        let here = known.world(place(t));
        let distance = self.distance(known, 0, here).min(self.distance(known, 1, here));
        // Towards the larger label, whichever way the edge runs.
        let normal = self.normal(known, here);
        let normal = if labels[0] < labels[1] { normal } else { -normal };
        Between { position: place(t), distance, normal }
    }

    /// The place within three or four corners, all of different labels.
    pub(crate) fn within<const N: usize>(&mut self, known: &Known<'_>, corners: [Corner; N]) -> Between {
        self.gather(known, &corners);
        let labels = corners.map(|corner| corner.label);
        let place = |weights: [f64; N]| -> [f64; 3] {
            std::array::from_fn(|a| (0..N).map(|n| weights[n] * corners[n].place[a]).sum::<f64>())
        };
        let (mut weights, mut last) = ([1.0 / N as f64; N], [f64::INFINITY; N]);
        for n in 1..=LOOKUPS {
            let at = |weights: [f64; N]| -> [f64; N] {
                let here = known.world(place(weights));
                std::array::from_fn(|n| self.distance(known, n, here))
            };
            weights = balance(at);
            let is_settled = (0..N).all(|n| (weights[n] - last[n]).abs() < SETTLED);
            if n == LOOKUPS || is_settled || !self.search_nearest(known, &labels, place(weights)) {
                break;
            }
            last = weights;
        }
        let here = known.world(place(weights));
        let distance = (0..N).map(|n| self.distance(known, n, here)).fold(f64::INFINITY, f64::min);
        Between { position: place(weights), distance, normal: DVec3::ZERO }
    }

    /// A place within corners that was found otherwise.
    pub(crate) fn at(&mut self, known: &Known<'_>, corners: &[Corner], position: [f64; 3]) -> Between {
        self.gather(known, corners);
        let labels: Vec<u32> = corners.iter().map(|corner| corner.label).collect();
        self.search_nearest(known, &labels, position);
        let here = known.world(position);
        let distance = (0..labels.len()).map(|n| self.distance(known, n, here)).fold(f64::INFINITY, f64::min);
        Between { position, distance, normal: DVec3::ZERO }
    }

    /// The direction in which the difference of the distances to the first two labels grows fastest.
    fn normal(&self, known: &Known<'_>, here: [f64; 3]) -> DVec3 {
        let away = [0, 1].map(|n| {
            let nearer =
                |a: &&u32, b: &&u32| known.shapes.distance(here, **a).total_cmp(&known.shapes.distance(here, **b));
            let source = self.of_label[n].iter().min_by(nearer);
            let from = |&source: &u32| DVec3::from(here) - DVec3::from(known.shapes.closest(here, source));
            unit(source.map_or(DVec3::ZERO, from))
        });
        unit(away[0] - away[1])
    }

    /// Collects the sources of each corner's label one voxel around, those nearest to the middle of the corners.
    fn gather(&mut self, known: &Known<'_>, corners: &[Corner]) {
        let first = corners[0].halves;
        let lowest = |a: usize| corners.iter().fold(first[a], |lo, corner| lo.min(corner.halves[a]));
        let highest = |a: usize| corners.iter().fold(first[a], |hi, corner| hi.max(corner.halves[a]));
        let lo = std::array::from_fn(|a| lowest(a).div_euclid(2) - 1);
        let hi = std::array::from_fn(|a| (highest(a) + 1).div_euclid(2) + 2);
        let around = Box3::new(lo, hi).intersect(&known.part);
        let sum = |a: usize| corners.iter().map(|corner| corner.place[a]).sum::<f64>();
        let centre = std::array::from_fn(|a| sum(a) / corners.len() as f64);
        let middle = known.world(centre);
        for (sources, label) in self.of_label.iter_mut().zip(corners.iter().map(|corner| corner.label)) {
            sources.clear();
            for (y, z) in around.rows() {
                let row = known.part.offset_of([around.lo[0], y, z])..;
                let width = around.shape()[0] as usize;
                for (&own, &source) in known.labels[row.clone()][..width].iter().zip(&known.sources[row][..width]) {
                    if own == label && !sources.contains(&source) {
                        sources.push(source);
                    }
                }
            }
            sources.sort_by_cached_key(|&source| known.shapes.distance(middle, source).to_bits());
            sources.truncate(KEPT);
            // A label thinner than a voxel may have none of its own around.
            if sources.is_empty() && label > 0 {
                sources.push(known.nearest(label, centre));
            }
        }
    }

    /// Collects the nearest source of each label at a place; returns whether any was new.
    fn search_nearest(&mut self, known: &Known<'_>, labels: &[u32], place: [f64; 3]) -> bool {
        let mut is_new = false;
        for (sources, &label) in self.of_label.iter_mut().zip(labels).filter(|(_, label)| **label > 0) {
            let nearest = known.nearest(label, place);
            if !sources.contains(&nearest) {
                sources.push(nearest);
                is_new = true;
            }
        }
        is_new
    }

    /// The distance to the nearest collected source of the n-th label.
    fn distance(&self, known: &Known<'_>, n: usize, here: [f64; 3]) -> f64 {
        self.of_label[n].iter().map(|&source| known.shapes.distance(here, source)).fold(f64::INFINITY, f64::min)
    }
}

/// The zero of a function between 0, where it is negative, and 1, where it is positive; the end that is wrong otherwise.
fn root(f: impl Fn(f64) -> f64, resolution: f64) -> f64 {
    let (mut lo, mut hi) = ((0.0, f(0.0)), (1.0, f(1.0)));
    if !(lo.1.is_finite() && hi.1.is_finite()) {
        return 0.5;
    }
    if lo.1 >= 0.0 {
        return 0.0;
    }
    if hi.1 <= 0.0 {
        return 1.0;
    }
    let mut last = 0;
    let mut t = 0.5;
    for _ in 0..STEPS {
        t = lo.0 - lo.1 * (hi.0 - lo.0) / (hi.1 - lo.1);
        let value = f(t);
        if value.abs() <= resolution {
            break;
        }
        // An end that stays twice counts half.
        if value < 0.0 {
            lo = (t, value);
            hi.1 *= if last == -1 { 0.5 } else { 1.0 };
            last = -1;
        } else {
            hi = (t, value);
            lo.1 *= if last == 1 { 0.5 } else { 1.0 };
            last = 1;
        }
    }
    t
}

/// Weights of the corners of a simplex at which all distances are equal, by Newton's method from the middle, held within
/// the simplex a little off its sides.
fn balance<const N: usize>(distances: impl Fn([f64; N]) -> [f64; N]) -> [f64; N] {
    let mut weights = [1.0 / N as f64; N];
    for _ in 0..STEPS {
        let now = distances(weights);
        // What a distance changes by on the way to each corner, the first one's weight being what is left.
        let towards: [[f64; N]; N] = std::array::from_fn(|n| {
            let mut moved = weights;
            moved[n] += SMALL_STEP;
            moved[0] -= SMALL_STEP;
            distances(moved)
        });
        // Row n: the n-th distance less the first becomes 0. One column more is the right side.
        let rows = (1..N).map(|row| {
            let slope = |n: usize| (towards[n][row] - now[row] - towards[n][0] + now[0]) / SMALL_STEP;
            (1..N).map(slope).chain([now[0] - now[row]]).collect()
        });
        let Some(step) = solved(rows.collect()) else { break };
        let moved_by = |part: f64| {
            let mut next = weights;
            for (n, by) in step.iter().enumerate() {
                next[n + 1] += part * by;
                next[0] -= part * by;
            }
            inward(next)
        };
        // Where other sources become the nearest on the way, a whole step may lead farther off.
        let is_nearer = |next: &[f64; N]| spread(distances(*next)) < spread(now);
        let parts = (0..HALVINGS).map(|n| 0.5_f64.powi(n));
        let Some(next) = parts.map(moved_by).find(is_nearer) else { break };
        let moved = (0..N).map(|n| (next[n] - weights[n]).abs()).fold(0.0, f64::max);
        weights = next;
        if moved < RESOLUTION {
            break;
        }
    }
    weights
}

/// How far the largest is from the smallest.
fn spread<const N: usize>(values: [f64; N]) -> f64 {
    let (lo, hi) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), v| (lo.min(*v), hi.max(*v)));
    hi - lo
}

/// Weights that lie within the simplex, and a little off its sides.
fn inward<const N: usize>(weights: [f64; N]) -> [f64; N] {
    let kept = weights.map(|w| w.max(LEAST_WEIGHT));
    let sum: f64 = kept.iter().sum();
    kept.map(|w| w / sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_are_found_and_ends_kept() {
        let cubic = |t: f64| (t - 0.3) * (1.0 + t * t);
        assert!((root(cubic, 1e-9) - 0.3).abs() < 1e-8);
        assert_eq!((root(|_| 1.0, 1e-9), root(|_| -1.0, 1e-9), root(|t| t / 0.0, 1e-9)), (0.0, 1.0, 0.5));
    }

    #[test]
    fn distances_are_balanced() {
        // At the weights 0.5, 0.3, 0.2 all three distances are the same.
        let corners = [[0.2, 0.6, 0.7], [0.9, 0.3, 0.5], [0.65, 0.55, 0.0]];
        let linear = |w: [f64; 3]| std::array::from_fn(|n| (0..3).map(|v| w[v] * corners[v][n]).sum::<f64>());
        let found = linear(balance(linear));
        assert!((found[0] - found[1]).abs() < 1e-6 && (found[1] - found[2]).abs() < 1e-6, "{found:?}");
        assert_eq!(balance(|_: [f64; 3]| [1.0; 3]), [1.0 / 3.0; 3]);
        assert_eq!(inward([2.0, -1.0, 0.0]).iter().sum::<f64>(), 1.0);
    }
}
