//! A second look at the sources of a finished field, where its distance bends.
//!
//! Sources travel from neighbour to neighbour, so a source is lost on a voxel at the tip of its Voronoi cell where the
//! tip is thinner than a voxel (Danielsson 1980): no neighbour has it to offer. Voxels two steps away do. Where that
//! can be is seen from distances alone. A source at distance e from a voxel is at squared distances that sum to
//! 2 e^2 + 2 h^2 from the two neighbours on an axis, neither of which is farther from its own source: so where a pair of
//! neighbours has more than 2 (d - t)^2 + 2 h^2, no source is nearer than d - t. On the faces of Voronoi cells a pair
//! along the face has it. The pair may have lost sources itself, at a ridge along the axis; so a second pair must not
//! fall off either: its sum must be more than 2 (d - k)^2. What is left are the edges and corners where cells meet, few
//! voxels of all.
//! In: source indices, [`NO_SOURCE`] where none is known, halo 2 on all 26 sides; out: source indices. Ties keep the
//! source that was there; of equally near others the first in `[z][y][x]` order is taken.

use super::initialise::NO_SOURCE;
use super::precision::Real;
use super::tracked::TrackedSource;
use crate::grid::{Box3, Geometry};

/// How far around a voxel others are asked.
pub const MARGIN: i64 = 2;
/// How much nearer a source may be without being looked for, t above, in the smallest spacing.
const TOLERANCE: f64 = 0.05;
/// By how much a second pair of neighbours may fall off, k above, in the smallest spacing.
const RIDGE: f64 = 0.02;

/// Looks again at the voxels of `part`: `found` are the sources of `known`, dense `[z][y][x]`, which is `part` with
/// [`MARGIN`] voxels more on every side as far as the grid goes; `out`, dense over `part`, gets the nearer ones.
pub fn look_again<S: TrackedSource>(
    sources: &S,
    geometry: &Geometry,
    known: &Box3,
    found: &[u32],
    part: &Box3,
    out: &mut [u32],
) {
    let squared = Squared::new(sources, known, found, part);
    let width = part.shape()[0] as usize;
    let mut bent = vec![0; width];
    for ((y, z), out) in part.rows().zip(out.chunks_exact_mut(width)) {
        out.copy_from_slice(&found[known.offset_of([part.lo[0], y, z])..][..width]);
        squared.bends(geometry, [y, z], &mut bent);
        for (x, out) in (part.lo[0]..).zip(out).zip(&bent).filter_map(|(voxel, &bent)| (bent != 0).then_some(voxel)) {
            *out = nearest(sources, known, found, [x, y, z], *out);
        }
    }
}

/// Where voxels lie, as distances are computed from.
fn place<S: TrackedSource>(sources: &S, voxel: [i64; 3]) -> [S::Number; 3] {
    std::array::from_fn(|a| sources.coordinate(a, voxel[a]))
}

/// The nearest of the sources around a voxel, whose own is `kept`.
fn nearest<S: TrackedSource>(sources: &S, known: &Box3, found: &[u32], voxel: [i64; 3], kept: u32) -> u32 {
    let here = place(sources, voxel);
    let (mut best, mut least) = (kept, sources.squared(here, kept));
    let mut asked = kept;
    let around = Box3::new(voxel, voxel.map(|v| v + 1)).grow(MARGIN).intersect(known);
    let width = around.shape()[0] as usize;
    for (y, z) in around.rows() {
        for &source in &found[known.offset_of([around.lo[0], y, z])..][..width] {
            if source == asked || source == NO_SOURCE {
                continue;
            }
            asked = source;
            let squared = sources.squared(here, source);
            if squared < least {
                (best, least) = (source, squared);
            }
        }
    }
    best
}

/// Squared distances of a box of voxels and of those one step beyond; infinite where nothing is known.
struct Squared<A> {
    grown: Box3,
    values: Vec<A>,
}

impl<A: Real> Squared<A> {
    fn new<S: TrackedSource<Number = A>>(sources: &S, known: &Box3, found: &[u32], part: &Box3) -> Self {
        let grown = part.grow(1);
        let mut values = vec![A::INFINITY; grown.len()];
        let within = grown.intersect(known);
        let width = within.shape()[0] as usize;
        for (y, z) in within.rows() {
            let row = &mut values[grown.offset_of([within.lo[0], y, z])..][..width];
            let found = &found[known.offset_of([within.lo[0], y, z])..][..width];
            for ((x, squared), &source) in (within.lo[0]..).zip(row).zip(found) {
                *squared = sources.squared(place(sources, [x, y, z]), source);
            }
        }
        Self { grown, values }
    }

    /// Says for each voxel of a row whether a nearer source may have been lost.
    fn bends(&self, geometry: &Geometry, [y, z]: [i64; 2], bent: &mut [u32]) {
        let [nx, ny, _] = self.grown.shape().map(|n| n as usize);
        let at = self.grown.offset_of([self.grown.lo[0] + 1, y, z]);
        let strides = [1, nx, nx * ny];
        let row = |at: usize| &self.values[at..][..bent.len()];
        pulp::Arch::new().dispatch(Bends {
            here: row(at),
            beside: strides.map(|stride| [row(at - stride), row(at + stride)]),
            apart: geometry.spacing.map(|h| A::of(2.0 * h * h)),
            tolerance: [TOLERANCE, RIDGE].map(|t| A::of(t * geometry.min_spacing())),
            bent,
        });
    }
}

/// A row of squared distances and those beside it, compared for each vector unit.
struct Bends<'a, A> {
    here: &'a [A],
    beside: [[&'a [A]; 2]; 3],
    apart: [A; 3],
    /// t and k.
    tolerance: [A; 2],
    bent: &'a mut [u32],
}

impl<A: Real> pulp::NullaryFnOnce for Bends<'_, A> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { here, beside: [x, y, z], apart, tolerance, bent } = self;
        let count = bent.len();
        let [here, xl, xu, yl, yu, zl, zu] = [here, x[0], x[1], y[0], y[1], z[0], z[1]].map(|row| &row[..count]);
        let zero = A::default();
        let pair = |lower: A, upper: A| {
            let sum = lower + upper;
            if sum < A::INFINITY { sum } else { zero }
        };
        for i in 0..count {
            let [a, b, c] = [pair(xl[i], xu[i]), pair(yl[i], yu[i]), pair(zl[i], zu[i])];
            let straight = (a - apart[0]).larger(b - apart[1]).larger(c - apart[2]);
            let second = a.smaller(b).larger(a.larger(b).smaller(c));
            let distance = here[i].root();
            let [kept, even] = tolerance.map(|t| {
                let nearer = (distance - t).larger(zero);
                nearer * nearer + nearer * nearer
            });
            // Without branches, so that lanes stay together.
            let unsure = u32::from(straight <= kept) | u32::from(second <= even);
            bent[i] = unsure & u32::from(here[i] < A::INFINITY) & u32::from(kept > zero);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::FACES;
    use crate::kernel::distance::vector_distance::VectorDistance;

    const EDGE: i64 = 14;

    fn geometry() -> Geometry {
        Geometry { shape: [EDGE; 3], spacing: [0.5, 0.5, 0.7], origin: [3.0, -2.0, 0.0], unit: None }
    }

    /// Points near a sphere around the grid's centre, by the fractional parts of multiples of irrational numbers: cells
    /// run to thin tips at the centre.
    fn cloud() -> Vec<[f64; 3]> {
        let (grid, part) = (geometry(), |n: usize, root: f64| (n as f64 * root.sqrt()).fract());
        let centre = grid.position([EDGE / 2; 3]);
        let point = |n| {
            let (cos, turn) = (2.0 * part(n, 2.0) - 1.0, std::f64::consts::TAU * part(n, 3.0));
            let (sin, radius) = ((1.0 - cos * cos).sqrt(), 3.0 + 0.2 * part(n, 5.0));
            std::array::from_fn(|a| centre[a] + radius * [sin * turn.cos(), sin * turn.sin(), cos][a])
        };
        (1..120).map(point).collect()
    }

    fn voxels(part: Box3) -> impl Iterator<Item = [i64; 3]> {
        part.rows().flat_map(move |(y, z)| (part.lo[0]..part.hi[0]).map(move |x| [x, y, z]))
    }

    /// The nearest points of a voxel, the very nearest first.
    fn ranked(cloud: &[[f64; 3]], voxel: [i64; 3]) -> Vec<(f64, u32)> {
        let here = geometry().position(voxel);
        let length = |p: &[f64; 3]| (0..3).map(|a| (p[a] - here[a]).powi(2)).sum::<f64>().sqrt();
        let mut all: Vec<(f64, u32)> = cloud.iter().map(length).zip(0..).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all
    }

    #[test]
    fn a_lost_source_is_found_two_steps_away() {
        let (grid, cloud) = (geometry(), cloud());
        let (method, all) = (VectorDistance::<f64>::new(&grid, &cloud), grid.domain());
        let exact: Vec<u32> = voxels(all).map(|v| ranked(&cloud, v)[0].1).collect();
        let mut out = exact.clone();
        look_again(&method, &grid, &all, &exact, &all, &mut out);
        assert_eq!(out, exact, "an exact field stays as it is");
        let mut lost = 0;
        for v in voxels(all.grow(-2)) {
            let nearest = ranked(&cloud, v);
            let has_it = |v: [i64; 3]| exact[all.offset_of(v)] == nearest[0].1;
            let walled_in = FACES.iter().all(|face| !has_it(std::array::from_fn(|a| v[a] + face.offset()[a])));
            let mut near = voxels(Box3::new(v, v.map(|v| v + 1)).grow(2)).filter(|&near| near != v);
            if nearest[1].0 - nearest[0].0 < 0.05 || !walled_in || !near.any(has_it) {
                continue;
            }
            let mut found = exact.clone();
            found[all.offset_of(v)] = nearest[1].1;
            look_again(&method, &grid, &all, &found, &all, &mut out);
            assert_eq!(out, exact, "{v:?}");
            lost += 1;
        }
        assert!(lost > 0, "the cloud has no thin tips");
    }

    #[test]
    fn parts_are_looked_at_as_the_whole_is() {
        let (grid, cloud) = (geometry(), cloud());
        let (method, all) = (VectorDistance::<f32>::new(&grid, &cloud), grid.domain());
        // Every seventh voxel has the wrong one of its two nearest, some know of none.
        let rank = |n: i64| usize::from(n % 7 == 0);
        let known = |n: i64, s: u32| if n % 31 == 0 { NO_SOURCE } else { s };
        let found: Vec<u32> = voxels(all).zip(0..).map(|(v, n)| known(n, ranked(&cloud, v)[rank(n)].1)).collect();
        let mut whole = found.clone();
        look_again(&method, &grid, &all, &found, &all, &mut whole);
        assert!(whole.iter().zip(&found).any(|(a, b)| a != b));
        for part in
            [Box3::new([0, 3, 5], [7, 4, 14]), Box3::new([6, 6, 6], [7, 7, 7]), Box3::new([9, 0, 2], [14, 14, 9])]
        {
            let known = part.grow(MARGIN).intersect(&all);
            let around: Vec<u32> = voxels(known).map(|v| found[all.offset_of(v)]).collect();
            let mut out = vec![NO_SOURCE; part.len()];
            look_again(&method, &grid, &known, &around, &part, &mut out);
            let expected: Vec<u32> = voxels(part).map(|v| whole[all.offset_of(v)]).collect();
            assert_eq!(out, expected, "{part:?}");
        }
    }
}
