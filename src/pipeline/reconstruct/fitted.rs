//! The surface around each point of a cloud, and vertices put where these lie (docs/algorithms.md, "Vertices on the points' surface").
//!
//! Which side of a point is out is told by u, which is solved: so the points of two sheets are told apart however near they lie. Places are
//! relative to the grid's origin, so that fits are the same bits wherever a cloud lies.

use std::collections::BTreeMap;

use glam::DVec3;
use rstar::primitives::GeomWithData;
use rstar::{AABB, RTree};

use crate::error::Result;
use crate::exec::{Stage, Workers};
use crate::grid::{Box3, BrickId, Geometry};
use crate::kernel::points::local_fit::{Blend, LocalFit, Looking};
use crate::kernel::surface::{Patch, Surroundings, outward};
use crate::pipeline::surface::{Placement, read_padded};
use crate::store::BrickArray;

/// Neighbours that a fit is made of, the point among them.
const NEIGHBOURS: usize = 14;
/// No fit reaches farther than so many times the usual.
const MOST_REACH: f64 = 3.0;
/// Parts of the smallest spacing that a vertex is moved at most.
const MOST_MOVED: f64 = 0.3;
/// And parts of the room between two sheets: both may move towards each other, slanted ones are nearer than along an axis, and they turn
/// where they meet. From two voxels on, where the room is not known, that is as much.
const OF_ROOM: f64 = 0.15;
/// Voxels along an edge of the cubes that fits are sorted into while a patch is looked at.
const CUBE: i64 = 2;
/// Points that one thread takes at a time.
const AT_ONCE: usize = 512;
/// Bytes a point takes: its place, node, normal and fit.
pub(super) const BYTES: u64 = 320;

type Numbered = GeomWithData<[f64; 3], u32>;

/// The fits of a cloud.
pub(super) struct Fitted<'a> {
    geometry: &'a Geometry,
    tree: RTree<Numbered>,
    /// Of each point, where its neighbours tell one.
    fits: Vec<Option<LocalFit>>,
    /// The farthest that any of them reaches.
    reach: f64,
}

impl<'a> Fitted<'a> {
    /// Fits the surface around each of the points, of which u has the sides.
    ///
    /// # Errors
    /// When the run is interrupted.
    pub(super) fn to(
        stage: &Stage<'_>,
        u: &BrickArray<f32>,
        geometry: &'a Geometry,
        points: &[[f64; 3]],
    ) -> Result<Self> {
        let looking = outward_of(stage, u, geometry, points)?;
        let points: Vec<[f64; 3]> = looking.iter().map(|point| point.at.to_array()).collect();
        let tree = RTree::bulk_load(points.iter().zip(0..).map(|(&p, n)| GeomWithData::new(p, n)).collect());
        let numbers: Vec<u32> = (0..points.len() as u32).collect();
        let parts: Vec<&[u32]> = numbers.chunks(AT_ONCE).collect();
        let found = stage.run(&parts, &Workers::new(Vec::new), |near, part| {
            let fit = |&n: &u32| {
                near.clear();
                let around = tree.nearest_neighbor_iter(points[n as usize]).take(NEIGHBOURS);
                near.extend(around.map(|q: &Numbered| looking[q.data as usize]));
                LocalFit::around(looking[n as usize], near)
            };
            Ok(part.iter().map(fit).collect::<Vec<_>>())
        })?;
        let mut fits: Vec<Option<LocalFit>> = found.into_iter().flatten().collect();
        let mut reaches: Vec<f64> = fits.iter().flatten().map(LocalFit::reach).collect();
        reaches.sort_unstable_by(f64::total_cmp);
        let reach = MOST_REACH * reaches.get(reaches.len() / 2).copied().unwrap_or(0.0);
        fits.iter_mut().flatten().for_each(|fit| fit.reach_no_farther_than(reach));
        let reach = reaches.last().map_or(0.0, |&last| last.min(reach));
        Ok(Self { geometry, tree, fits, reach })
    }

    /// The fits that reach into a box, in order of their points.
    fn reaching(&self, low: [f64; 3], high: [f64; 3]) -> Vec<&LocalFit> {
        let around = AABB::from_corners(low.map(|v| v - self.reach), high.map(|v| v + self.reach));
        let mut numbers: Vec<u32> = self.tree.locate_in_envelope(around).map(|point| point.data).collect();
        numbers.sort_unstable();
        numbers.iter().filter_map(|&n| self.fits[n as usize].as_ref()).collect()
    }
}

impl Placement for Fitted<'_> {
    fn farthest(&self) -> f64 {
        MOST_MOVED * self.geometry.min_spacing()
    }

    fn place(&self, patch: &mut Patch, around: &[Surroundings]) -> f64 {
        if patch.positions.is_empty() {
            return 0.0;
        }
        let (geometry, cells) = (self.geometry, patch.cells);
        let corner = |voxel: [i64; 3]| std::array::from_fn(|a| voxel[a] as f64 * geometry.spacing[a]);
        let (low, high): ([f64; 3], [f64; 3]) = (corner(cells.lo), corner(cells.hi));
        let fits = self.reaching(low, high);
        let counts = cells.shape().map(|n| (n + CUBE - 1) / CUBE);
        let cubes = Box3::from_shape(counts);
        let edge = geometry.spacing.map(|h| h * CUBE as f64);
        let cube = |p: [f64; 3]| -> [i64; 3] {
            std::array::from_fn(|a| (((p[a] - low[a]) / edge[a]).floor() as i64).clamp(0, counts[a] - 1))
        };
        let mut lists: Vec<Vec<u32>> = vec![Vec::new(); cubes.len()];
        for (n, fit) in (0..).zip(&fits) {
            let at = fit.at().to_array();
            let part = Box3::new(cube(at.map(|v| v - fit.reach())), cube(at.map(|v| v + fit.reach())).map(|v| v + 1));
            for (y, z) in part.rows() {
                (part.lo[0]..part.hi[0]).for_each(|x| lists[cubes.offset_of([x, y, z])].push(n));
            }
        }
        let (most, mut moved) = (self.farthest(), 0.0_f64);
        for (position, around) in patch.positions.iter_mut().zip(around) {
            let place: [f64; 3] = std::array::from_fn(|a| position[a] * geometry.spacing[a]);
            let mut blend = Blend::at(place.into(), around.outward);
            for &n in &lists[cubes.offset_of(cube(place))] {
                blend.add(fits[n as usize]);
            }
            let way = blend.way(most.min(OF_ROOM * around.room));
            moved = moved.max(way.length());
            (0..3).for_each(|a| position[a] += way[a] / geometry.spacing[a]);
        }
        moved
    }
}

/// The points, relative to the grid's origin, with the side of each that u has outside.
fn outward_of(
    stage: &Stage<'_>,
    u: &BrickArray<f32>,
    geometry: &Geometry,
    points: &[[f64; 3]],
) -> Result<Vec<Looking>> {
    let grid = *u.set().grid();
    let inside = |point: &[f64; 3]| {
        let voxel = geometry.to_voxels(*point);
        std::array::from_fn(|a| (voxel[a].floor() as i64).clamp(0, geometry.shape[a] - 1))
    };
    let mut by_brick: BTreeMap<BrickId, Vec<usize>> = BTreeMap::new();
    for (n, point) in points.iter().enumerate() {
        by_brick.entry(grid.brick_of(inside(point)).unwrap_or(0)).or_default().push(n);
    }
    let groups: Vec<(BrickId, Vec<usize>)> = by_brick.into_iter().collect();
    let found = stage.run(&groups, &Workers::new(Vec::new), |values, (brick, members)| {
        let part = grid.brick_box(*brick).grow(2);
        read_padded(u, &part, values)?;
        let way = |&n: &usize| outward(values, &part, geometry.to_voxels(points[n]), geometry.spacing);
        Ok(members.iter().map(way).collect::<Vec<_>>())
    })?;
    let origin = DVec3::from(geometry.origin);
    let mut looking: Vec<Looking> =
        points.iter().map(|&p| Looking { at: DVec3::from(p) - origin, outward: DVec3::ZERO }).collect();
    for ((_, members), ways) in groups.iter().zip(found) {
        members.iter().zip(ways).for_each(|(&n, way)| looking[n].outward = way);
    }
    Ok(looking)
}
