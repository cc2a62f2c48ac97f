//! Sources that reach out of a grid, and the voxels that they fix through its faces (docs/algorithms.md, "Outside of the
//! grid").
//!
//! On the straight way from a voxel to the nearest place of all sources that place stays the nearest. Where it lies in the
//! grid, its source fixes voxels around it, and what is carried from there reaches the voxel. Where it lies outside, the
//! way leaves the grid through a face: so those voxels of the outermost layer whose nearest place lies outside are fixed at
//! its exact distance, and distance is carried inwards from them. A voxel near a face that a source in the grid fixes may
//! have a nearer one outside too, and gets it. The nearest of all sources is found by R-trees, in f64; of equally near ones
//! the lower label counts, then the lower index. What a voxel gets depends on nothing but the sources and the grid.
//!
//! Sources that lie denser than voxels are not all nearest to a voxel of the outermost layer, but may be to one deeper in
//! the grid. So where methods keep sources, all voxels are looked up once more when distance has been carried
//! ([`OutsideSources::lower`]): what they have been handed bounds the search, block by block (`outside_block`).

use rstar::primitives::GeomWithData;
use rstar::{PointDistance, RTree};

use super::outside_block::{Block, blocks};
use super::seeds::Seeds;
use crate::grid::{Box3, DataSets, Geometry, NO_SOURCE};
use crate::kernel::distance::features::source_trees::Placed;
use crate::kernel::distance::state::source::counts_before;
use crate::kernel::distance::state::source::squared_distance;

/// Beyond the last voxel centres by more than this, in voxels, is outside; less is rounding. Below the first ones nothing
/// is: there a source that lies outside by rounding alone would fix no voxel.
const ROUNDING: f64 = 1e-6;

/// All sources, of which some reach out of the grid.
#[derive(Debug)]
pub struct OutsideSources<'a> {
    geometry: &'a Geometry,
    sets: &'a DataSets,
    /// Those that reach out of the grid.
    outside: Trees,
    /// All others.
    inside: Trees,
}

/// Sources, sorted.
#[derive(Debug)]
struct Trees {
    points: RTree<GeomWithData<[f64; 3], u32>>,
    triangles: RTree<GeomWithData<Placed, u32>>,
}

impl Trees {
    /// Of the sources for which `reach_out` is that.
    fn new(geometry: &Geometry, sets: &DataSets, reach_out: bool) -> Self {
        let first = sets.positions.len() as u32;
        let points = (0..).zip(&sets.positions).filter(|(_, point)| is_outside(geometry, **point) == reach_out);
        let points = points.map(|(n, &point)| GeomWithData::new(point, n)).collect();
        let triangles = (0..sets.mesh.len()).filter(|&n| reaches_out(geometry, sets, n) == reach_out);
        let placed = |n| GeomWithData::new(Placed::new(sets.mesh.corners(n)), first + n as u32);
        Self { points: RTree::bulk_load(points), triangles: RTree::bulk_load(triangles.map(placed).collect()) }
    }

    /// The squared distance of the nearest.
    fn nearest(&self, here: [f64; 3]) -> Option<f64> {
        let point = self.points.nearest_neighbor(here).map(|point| point.distance_2(&here));
        let triangle = self.triangles.nearest_neighbor(here).map(|triangle| triangle.distance_2(&here));
        point.into_iter().chain(triangle).reduce(f64::min)
    }

    /// Those within a squared distance, each with its own and its nearest place.
    fn within(&self, here: [f64; 3], limit: f64) -> impl Iterator<Item = ((f64, u32), [f64; 3])> {
        let points = self.points.locate_within_distance(here, limit).map(move |point| {
            let place = *point.geom();
            ((squared_distance(here, place), point.data), place)
        });
        points.chain(self.triangles.locate_within_distance(here, limit).map(move |placed| {
            let triangle = &placed.geom().triangle;
            ((triangle.distance_squared(here), placed.data), triangle.closest_point(here))
        }))
    }
}

impl<'a> OutsideSources<'a> {
    /// Sorts the sources; none where all of them lie in the grid.
    #[must_use]
    pub fn new(geometry: &'a Geometry, sets: &'a DataSets) -> Option<Self> {
        if count_outside(geometry, sets) == 0 {
            return None;
        }
        let [outside, inside] = [true, false].map(|reach_out| Trees::new(geometry, sets, reach_out));
        Some(Self { geometry, sets, outside, inside })
    }

    /// Fixes voxels of `part` at sources outside, none that is farther than `farthest`, where these are nearer than what
    /// `seeds` hold: sources in the grid that fix voxels. Dense `[z][y][x]` with room for `edge`^3 voxels from `part.lo` on.
    pub fn fix_voxels(&self, part: &Box3, edge: usize, farthest: f64, seeds: &mut Seeds) {
        for (y, z) in part.rows() {
            let row = ((z - part.lo[2]) as usize * edge + (y - part.lo[1]) as usize) * edge;
            for x in part.lo[0]..part.hi[0] {
                let place = row + (x - part.lo[0]) as usize;
                let known = (seeds.squared[place], seeds.source[place]);
                let depth = self.depth([x, y, z]);
                if depth > 0.0 && (known.1 == NO_SOURCE || depth * depth > known.0) {
                    continue;
                }
                let Some(found) = self.nearest_outside([x, y, z]) else { continue };
                if found.0 <= farthest * farthest && counts_before(found, known, |source| self.sets.label(source)) {
                    (seeds.squared[place], seeds.source[place]) = found;
                }
            }
        }
    }

    /// How far a voxel is from the outermost layer.
    fn depth(&self, voxel: [i64; 3]) -> f64 {
        let Geometry { shape, spacing, .. } = self.geometry;
        let along = |a: usize| voxel[a].min(shape[a] - 1 - voxel[a]) as f64 * spacing[a];
        along(0).min(along(1)).min(along(2))
    }

    /// The source that is nearest to a voxel, with its squared distance, if its nearest place lies outside.
    fn nearest_outside(&self, voxel: [i64; 3]) -> Option<(f64, u32)> {
        let here = self.geometry.position(voxel);
        let each = [&self.outside, &self.inside];
        let least = each.into_iter().filter_map(|trees| trees.nearest(here)).reduce(f64::min)?;
        // Those that are as near, and what rounding hides.
        let limit = least * (1.0 + 1e-12);
        let label = |source| self.sets.label(source);
        let all = each.into_iter().flat_map(|trees| trees.within(here, limit));
        let nearest = all.reduce(|a, b| if counts_before(b.0, a.0, label) { b } else { a });
        nearest.filter(|(_, place)| is_outside(self.geometry, *place)).map(|(found, _)| found)
    }

    /// Looks voxels of `part` up among the sources that reach out of the grid, none that is farther than `farthest`, where
    /// one of these may be nearer than what they hold; of equally near ones the lower label counts, then the lower
    /// index. Dense `[z][y][x]` with room for `edge`^3 voxels from `part.lo` on. Returns whether any voxel changed.
    pub fn lower(&self, part: &Box3, edge: usize, farthest: f64, held: &mut Seeds) -> bool {
        let label = |source| self.sets.label(source);
        let mut changed = false;
        for voxels in blocks(part) {
            let place = |v: [i64; 3]| {
                let [x, y, z] = std::array::from_fn(|a| (v[a] - part.lo[a]) as usize);
                (z * edge + y) * edge + x
            };
            let mut block = Block::new(self.geometry, &voxels, |voxel| {
                let (at, depth) = (place(voxel), self.depth(voxel));
                // All of them are farther than the grid's face.
                (held.squared[at] >= depth * depth).then_some((held.squared[at], held.source[at]))
            });
            block.search(&self.outside.points, farthest, label);
            block.search(&self.outside.triangles, farthest, label);
            block.each_nearer(|voxel, nearer| {
                let at = place(voxel);
                (held.squared[at], held.source[at]) = nearer;
                changed = true;
            });
        }
        changed
    }
}

/// How many points lie outside of a grid, and triangles reach out of it.
#[must_use]
pub fn count_outside(geometry: &Geometry, sets: &DataSets) -> u64 {
    let points = sets.positions.iter().filter(|&&point| is_outside(geometry, point)).count();
    (points + (0..sets.mesh.len()).filter(|&n| reaches_out(geometry, sets, n)).count()) as u64
}

/// Whether a triangle reaches out of a grid.
fn reaches_out(geometry: &Geometry, sets: &DataSets, triangle: usize) -> bool {
    sets.mesh.corners(triangle).into_iter().any(|corner| is_outside(geometry, corner))
}

/// Whether a place lies outside of the box of voxel centres.
fn is_outside(geometry: &Geometry, place: [f64; 3]) -> bool {
    let at = geometry.to_voxels(place);
    (0..3).any(|a| at[a] < 0.0 || at[a] > (geometry.shape[a] - 1) as f64 + ROUNDING)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::TriangleMesh;

    fn grid() -> Geometry {
        Geometry { shape: [5, 4, 3], spacing: [1.0, 0.5, 2.0], origin: [10.0, 0.0, -1.0], unit: None }
    }

    fn fixed(sets: &DataSets, start: impl Fn(usize) -> (f64, u32)) -> Option<Seeds> {
        let geometry = grid();
        let outside = OutsideSources::new(&geometry, sets)?;
        let mut seeds = Seeds::new(125);
        (0..125).for_each(|n| (seeds.squared[n], seeds.source[n]) = start(n));
        outside.fix_voxels(&geometry.domain(), 5, f64::INFINITY, &mut seeds);
        Some(seeds)
    }

    #[test]
    fn sources_in_the_grid_need_nothing() {
        let mut sets = DataSets::default();
        sets.add_cloud(&[[10.0, 0.0, -1.0], [14.0, 1.5, 3.0], [12.0, 1.0, 0.0]]);
        assert!(fixed(&sets, |_| (f64::INFINITY, NO_SOURCE)).is_none());
        sets.add_cloud(&[[10.0, -1e-9, 0.0]]);
        assert_eq!(count_outside(&grid(), &sets), 1);
    }

    /// The outermost layer alone is fixed, where the nearest source lies outside, at its distance.
    #[test]
    fn faces_are_fixed_where_the_nearest_lies_outside() {
        let mut sets = DataSets::default();
        sets.add_cloud(&[[9.0, 0.7, 1.0], [14.0, 0.7, 1.0]]);
        let corners = vec![[0.0, 9.0, -9.0], [30.0, 9.0, -9.0], [12.0, 9.0, 50.0]];
        sets.add_mesh(&TriangleMesh::new(corners, vec![[0, 1, 2]]).unwrap());
        let seeds = fixed(&sets, |_| (f64::INFINITY, NO_SOURCE)).unwrap();
        let mut count = 0;
        for (y, z) in grid().domain().rows() {
            for x in 0..5 {
                let here = grid().position([x, y, z]);
                let away = [[9.0, 0.7, 1.0], [14.0, 0.7, 1.0]].map(|p| squared_distance(here, p));
                let is_outermost = x == 0 || x == 4 || y == 0 || y == 3 || z == 0 || z == 2;
                let at = ((z * 5 + y) * 5 + x) as usize;
                let expected = is_outermost && away[0] < away[1];
                let found = (seeds.squared[at], seeds.source[at]);
                assert_eq!(found, if expected { (away[0], 0) } else { (f64::INFINITY, NO_SOURCE) }, "{x} {y} {z}");
                count += usize::from(expected);
            }
        }
        assert!(count > 10);
    }

    /// What a source in the grid fixes near a face goes to a nearer one outside.
    #[test]
    fn voxels_that_are_fixed_near_a_face_get_what_is_nearer() {
        let mut sets = DataSets::default();
        sets.add_cloud(&[[9.9, 0.5, 1.0], [13.0, 0.5, 1.0]]);
        let at = 5 * 5 + 5 + 1;
        let known = |squared: f64| move |n: usize| if n == at { (squared, 1) } else { (f64::INFINITY, NO_SOURCE) };
        let after = |squared: f64| fixed(&sets, known(squared)).map(|seeds| seeds.source[at]);
        assert_eq!((after(4.0), after(0.5)), (Some(0), Some(1)));
    }
}
