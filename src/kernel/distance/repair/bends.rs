//! A second look at the sources of a finished field, where its distance bends.
//!
//! Sources travel from neighbour to neighbour, so a source is lost on a voxel at the tip of its Voronoi cell where the
//! tip is thinner than a voxel (Danielsson 1980): no neighbour has it to offer. Voxels two steps away do. Where that
//! can be is seen from distances alone. A source at distance e from a voxel is at squared distances that sum to 2 e^2 +
//! 2 h^2 from the two neighbours on an axis, neither of which is farther from its own source: so where a pair of
//! neighbours has more than 2 (d - t)^2 + 2 h^2, no source is nearer than d - t. On the faces of Voronoi cells a pair
//! along the face has it. The pair may have lost sources itself, at a ridge along the axis; so a second pair must not
//! fall off either: its sum must be more than 2 (d - k)^2. What is left are the edges and corners where cells meet, few
//! voxels of all.
//!
//! Labels are borders of cells too, and a wrong one is seen. So beside a voxel of another label, whose source is hardly
//! farther than a voxel's own, the nearest sources of both are looked up among those beside these two.
//!
//! In: source indices, [`NO_SOURCE`] where none is known, halo 2 on all 26 sides; out: source indices and squared
//! distances, f64. Bends are looked for in f32. Of equally near sources the one of the lower label is taken;
//! else the one that was there stays, and of others the first in `[z][y][x]` order is taken.

use super::descent::BesideSources;
use super::distinct::Distinct;
use super::label_borders::LabelBorders;
use super::repair_box::Labels;
use super::repair_box::RepairBox;
use crate::grid::{Box3, Geometry, NO_SOURCE};
use crate::kernel::distance::methods::tracked::TrackedSource;
use crate::kernel::distance::state::precision::Real;
use crate::kernel::distance::state::source::counts_before;

/// How far around a voxel others are asked.
pub const MARGIN: i64 = 2;
/// How much farther sources must be carried than they count, in voxels: those that may come to count, and what they
/// ask.
pub const REACH: i64 = MARGIN + 1;
/// How much farther the source of another label may be, in the smallest spacing, where a nearer one may have been lost.
const CLOSE: f64 = 0.15;
/// How much nearer a source may be without being looked for, t above, in the smallest spacing.
const TOLERANCE: f64 = 0.05;
/// By how much a second pair of neighbours may fall off, k above, in the smallest spacing.
const RIDGE: f64 = 0.02;

/// What a look ends with, dense `[z][y][x]` over its part.
#[derive(Clone, Debug, Default)]
pub struct Repair {
    /// The nearer sources.
    pub sources: Vec<u32>,
    /// The squared distances to them; infinite where none is known. Zeros where nothing needed them.
    pub squared: Vec<f64>,
    /// Squared distances of the part and of the voxels one step beyond, rounded.
    grown: Vec<f32>,
    /// Where sources differ.
    distinct: Distinct,
    /// Those around a voxel.
    around: Vec<u32>,
    /// Voxels of a plane where something may have been lost.
    bent: Vec<u32>,
    /// Where another label begins.
    borders: LabelBorders,
    beside: BesideSources,
}

impl Repair {
    /// Looks again at all voxels of a part.
    pub fn run<S: TrackedSource>(&mut self, sources: &S, repair_box: &RepairBox<'_>) {
        let labels = repair_box.labels.filter(|labels| !labels.sets.share_label(repair_box.found));
        self.measure(sources, repair_box, repair_box.lost_within.is_some() || labels.is_some());
        if repair_box.lost_within.is_some() {
            self.find_lost(sources, repair_box);
        }
        if let Some(labels) = labels {
            self.settle_labels(sources, repair_box, labels);
        }
    }

    fn find_lost<S: TrackedSource>(&mut self, sources: &S, repair_box: &RepairBox<'_>) {
        let RepairBox { geometry, part, .. } = *repair_box;
        self.distinct.mark(repair_box.known, repair_box.found);
        let [width, height, _] = part.shape().map(|n| n as usize);
        let counts_below = repair_box.counts_below();
        for (plane, z) in (part.lo[2]..part.hi[2]).enumerate() {
            self.bends(geometry, part, z);
            let bent = std::mem::take(&mut self.bent);
            for (n, _) in bent.iter().enumerate().filter(|(_, bent)| **bent != 0) {
                let at = plane * width * height + n;
                if self.squared[at] < counts_below {
                    let voxel = [part.lo[0] + (n % width) as i64, part.lo[1] + (n / width) as i64, z];
                    let kept = (self.sources[at], self.squared[at]);
                    (self.sources[at], self.squared[at]) = self.nearest(sources, repair_box, voxel, kept);
                }
            }
            self.bent = bent;
        }
    }

    /// Looks closer where another label's source is hardly farther than a voxel's own.
    fn settle_labels<S: TrackedSource>(&mut self, sources: &S, repair_box: &RepairBox<'_>, labels: Labels<'_>) {
        let Self { sources: kept, squared, borders, beside, .. } = self;
        let Labels { sets, trees } = labels;
        let close = if trees.is_some() { CLOSE * repair_box.geometry.min_spacing() } else { 0.0 };
        let counts_below = repair_box.counts_below();
        borders.each(repair_box, sets, |voxel, others| {
            let at = repair_box.part.offset_of(voxel);
            if squared[at] >= counts_below {
                return;
            }
            let to = |source| sources.squared_of_voxel(source, voxel);
            let limit = (squared[at].sqrt() + close).powi(2).max(squared[at]);
            let nearly = others.iter().map(|&other| (to(other), other)).filter(|other| other.0 <= limit);
            let own = (squared[at], kept[at]);
            let mut best = own;
            let mut is_close = false;
            for other in nearly {
                is_close = true;
                let other = trees.map_or(other, |trees| beside.descend(trees, sets, other, to));
                best = if counts_before(other, best, |s| sets.label(s)) { other } else { best };
            }
            if let Some(trees) = trees.filter(|_| is_close) {
                let own = beside.descend(trees, sets, own, to);
                best = if counts_before(own, best, |s| sets.label(s)) { own } else { best };
            }
            (squared[at], kept[at]) = best;
        });
    }

    /// The nearest of the sources around a voxel, which has the one that is `kept`, and its squared distance.
    fn nearest<S: TrackedSource>(
        &mut self,
        sources: &S,
        repair_box: &RepairBox<'_>,
        voxel: [i64; 3],
        kept: (u32, f64),
    ) -> (u32, f64) {
        let mut best = kept;
        let around = Box3::new(voxel, voxel.map(|v| v + 1)).grow(MARGIN).intersect(repair_box.known);
        let label = |source| repair_box.labels.map_or(0, |labels| labels.sets.label(source));
        self.distinct.list(repair_box.known, repair_box.found, &around, &mut self.around);
        for &source in &self.around {
            let squared = sources.squared_of_voxel(source, voxel);
            let is_tied = squared == best.1 && source != best.0;
            if squared < best.1 || (is_tied && label(source) < label(best.0)) {
                best = (source, squared);
            }
        }
        best
    }

    /// Fills in the sources as they are, and how far they are, where that is `needed`.
    fn measure<S: TrackedSource>(&mut self, sources: &S, repair_box: &RepairBox<'_>, needed: bool) {
        let RepairBox { part, known, found, .. } = *repair_box;
        let grown = part.grow(1);
        self.sources.resize(part.len(), NO_SOURCE);
        self.squared.resize(part.len(), f64::INFINITY);
        self.grown.clear();
        self.grown.resize(grown.len(), f32::INFINITY);
        let within = grown.intersect(known);
        let (width, own) = (within.shape()[0] as usize, part.shape()[0] as usize);
        let first = (part.lo[0] - within.lo[0]) as usize;
        let mut row = vec![0.0; width];
        for (y, z) in within.rows() {
            let found = &found[known.offset_of([within.lo[0], y, z])..][..width];
            if needed {
                sources.squared_row(found, [within.lo[0], y, z], &mut row);
            }
            let grown = &mut self.grown[grown.offset_of([within.lo[0], y, z])..][..width];
            grown.iter_mut().zip(&row).for_each(|(rounded, squared)| *rounded = *squared as f32);
            if (part.lo[1]..part.hi[1]).contains(&y) && (part.lo[2]..part.hi[2]).contains(&z) {
                let at = part.offset_of([part.lo[0], y, z]);
                self.sources[at..][..own].copy_from_slice(&found[first..][..own]);
                self.squared[at..][..own].copy_from_slice(&row[first..][..own]);
            }
        }
    }

    /// Says for each voxel of a plane of the part whether a nearer source may have been lost.
    fn bends(&mut self, geometry: &Geometry, part: &Box3, z: i64) {
        let grown = part.grow(1);
        let [width, height, _] = part.shape().map(|n| n as usize);
        self.bent.resize(width * height, 0);
        pulp::Arch::new().dispatch(Bends {
            squared: &self.grown,
            first: grown.offset_of([part.lo[0], part.lo[1], z]),
            strides: [1, width + 2, (width + 2) * (height + 2)],
            apart: geometry.spacing.map(|h| (2.0 * h * h) as f32),
            tolerance: [TOLERANCE, RIDGE].map(|t| (t * geometry.min_spacing()) as f32),
            width,
            bent: &mut self.bent,
        });
    }
}

/// A plane of squared distances and those beside it, compared for each vector unit.
struct Bends<'a> {
    squared: &'a [f32],
    /// Where the plane's first voxel lies, and how far its neighbours along each axis are from it.
    first: usize,
    strides: [usize; 3],
    apart: [f32; 3],
    /// t and k.
    tolerance: [f32; 2],
    width: usize,
    bent: &'a mut [u32],
}

impl pulp::NullaryFnOnce for Bends<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { squared, first, strides, apart, tolerance, width, bent } = self;
        for (y, bent) in bent.chunks_exact_mut(width).enumerate() {
            let at = first + y * strides[1];
            let row = |at: usize| &squared[at..][..width];
            let beside = strides.map(|stride| [row(at - stride), row(at + stride)]);
            bends_of_row(row(at), beside, apart, tolerance, bent);
        }
    }
}

#[inline(always)]
fn bends_of_row(
    here: &[f32],
    [[xl, xu], [yl, yu], [zl, zu]]: [[&[f32]; 2]; 3],
    apart: [f32; 3],
    tolerance: [f32; 2],
    bent: &mut [u32],
) {
    let count = bent.len();
    let [here, xl, xu, yl, yu, zl, zu] = [here, xl, xu, yl, yu, zl, zu].map(|row| &row[..count]);
    let pair = |lower: f32, upper: f32| {
        let sum = lower + upper;
        if sum < f32::INFINITY { sum } else { 0.0 }
    };
    for i in 0..count {
        let [a, b, c] = [pair(xl[i], xu[i]), pair(yl[i], yu[i]), pair(zl[i], zu[i])];
        let straight = (a - apart[0]).larger(b - apart[1]).larger(c - apart[2]);
        let second = a.smaller(b).larger(a.larger(b).smaller(c));
        let distance = here[i].root();
        let [kept, even] = tolerance.map(|t| {
            let nearer = (distance - t).larger(0.0);
            nearer * nearer + nearer * nearer
        });
        // Without branches, so that lanes stay together.
        let unsure = u32::from(straight <= kept) | u32::from(second <= even);
        bent[i] = unsure & u32::from(here[i] < f32::INFINITY) & u32::from(kept > 0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::FACES;
    use crate::kernel::distance::methods::vector_distance::VectorDistance;

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

    fn repaired(
        method: &VectorDistance<'_, f32>,
        geometry: &Geometry,
        known: &Box3,
        found: &[u32],
        part: &Box3,
    ) -> Repair {
        let mut repair = Repair::default();
        repair.run(method, &RepairBox { geometry, part, known, found, lost_within: Some(f64::INFINITY), labels: None });
        repair
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
        let (method, all) = (VectorDistance::<f32>::new(&grid, &cloud), grid.domain());
        let repair_box = |found: &[u32]| repaired(&method, &grid, &all, found, &all);
        let exact: Vec<u32> = voxels(all).map(|v| ranked(&cloud, v)[0].1).collect();
        assert_eq!(repair_box(&exact).sources, exact, "an exact field stays as it is");
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
            assert_eq!(repair_box(&found).sources, exact, "{v:?}");
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
        let whole = repaired(&method, &grid, &all, &found, &all).sources;
        assert!(whole.iter().zip(&found).any(|(a, b)| a != b));
        for part in
            [Box3::new([0, 3, 5], [7, 4, 14]), Box3::new([6, 6, 6], [7, 7, 7]), Box3::new([9, 0, 2], [14, 14, 9])]
        {
            let known = part.grow(MARGIN).intersect(&all);
            let around: Vec<u32> = voxels(known).map(|v| found[all.offset_of(v)]).collect();
            let repair = repaired(&method, &grid, &known, &around, &part);
            let expected: Vec<u32> = voxels(part).map(|v| whole[all.offset_of(v)]).collect();
            assert_eq!(repair.sources, expected, "{part:?}");
            for ((v, &source), &squared) in voxels(part).zip(&repair.sources).zip(&repair.squared) {
                assert_eq!(squared.sqrt(), method.squared_of_voxel(source, v).sqrt(), "{v:?}");
            }
        }
    }
}
