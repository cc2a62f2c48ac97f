//! Sources that reach out of a grid, and the voxels that they fix through its faces (docs/algorithms.md, "Outside of the
//! grid").
//!
//! On the straight way from a voxel to the nearest place of all sources that place stays the nearest. Where it lies in the
//! grid, its source fixes voxels around it, and what is carried from there reaches the voxel. Where it lies outside, the
//! way leaves the grid through a face: so those voxels of the outermost layer whose nearest place lies outside are fixed at
//! its exact distance, and distance is carried inwards from them. A voxel near a face that a source in the grid fixes may
//! have a nearer one outside too, and gets it. The nearest of all sources is found by R-trees, in f64; of equally near ones
//! the lower label counts, then the lower index. What a voxel gets depends on nothing but the sources and the grid.

use rstar::primitives::GeomWithData;
use rstar::{PointDistance, RTree};

use super::initialise::{NO_SOURCE, squared_distance};
use super::seeds::{Seeds, counts_before};
use super::source_trees::Placed;
use crate::grid::{Box3, DataSets, Geometry};

/// Beyond the last voxel centres by more than this, in voxels, is outside; less is rounding. Below the first ones nothing
/// is: there a source that lies outside by rounding alone would fix no voxel.
const ROUNDING: f64 = 1e-6;

/// All sources, of which some reach out of the grid.
#[derive(Debug)]
pub struct OutsideSources<'a> {
    geometry: &'a Geometry,
    sets: &'a DataSets,
    points: RTree<GeomWithData<[f64; 3], u32>>,
    triangles: RTree<GeomWithData<Placed, u32>>,
}

impl<'a> OutsideSources<'a> {
    /// Sorts the sources; none where all of them lie in the grid.
    #[must_use]
    pub fn new(geometry: &'a Geometry, sets: &'a DataSets) -> Option<Self> {
        if count_outside(geometry, sets) == 0 {
            return None;
        }
        let first = sets.positions.len() as u32;
        let points = (0..).zip(&sets.positions).map(|(n, &point)| GeomWithData::new(point, n)).collect();
        let placed = |n: u32| GeomWithData::new(Placed::new(sets.mesh.corners(n as usize)), first + n);
        let triangles = (0..sets.mesh.len() as u32).map(placed).collect();
        Some(Self { geometry, sets, points: RTree::bulk_load(points), triangles: RTree::bulk_load(triangles) })
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
        let point = self.points.nearest_neighbor(here).map(|point| point.distance_2(&here));
        let triangle = self.triangles.nearest_neighbor(here).map(|triangle| triangle.distance_2(&here));
        let least = point.into_iter().chain(triangle).reduce(f64::min)?;
        // Those that are as near, and what rounding hides.
        let limit = least * (1.0 + 1e-12);
        let points = self.points.locate_within_distance(here, limit).map(|point| {
            let place = *point.geom();
            ((squared_distance(here, place), point.data), place)
        });
        let triangles = self.triangles.locate_within_distance(here, limit).map(|placed| {
            let triangle = &placed.geom().triangle;
            ((triangle.distance_squared(here), placed.data), triangle.closest_point(here))
        });
        let label = |source| self.sets.label(source);
        let nearest = points.chain(triangles).reduce(|a, b| if counts_before(b.0, a.0, label) { b } else { a });
        nearest.filter(|(_, place)| is_outside(self.geometry, *place)).map(|(found, _)| found)
    }
}

/// How many points lie outside of a grid, and triangles reach out of it.
#[must_use]
pub fn count_outside(geometry: &Geometry, sets: &DataSets) -> u64 {
    let points = sets.positions.iter().filter(|&&point| is_outside(geometry, point)).count();
    let reaches_out = |&n: &usize| sets.mesh.corners(n).into_iter().any(|corner| is_outside(geometry, corner));
    (points + (0..sets.mesh.len()).filter(reaches_out).count()) as u64
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
