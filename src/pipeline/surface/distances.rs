//! How far points lie from a surface that is drawn brick by brick: nothing of the mesh is kept in memory. Most points lie beside it, and are
//! measured as the patches around them pass.

use std::collections::BTreeMap;

use super::isosurface::{Isosurface, Pencil};
use super::patch_distance::approach;
use super::shells::distances_anywhere;
use crate::error::Result;
use crate::exec::{Stage, Workers};
use crate::grid::{Box3, BrickId};
use crate::kernel::surface::Patch;

/// Largest spacings within which points are measured as patches pass.
const BESIDE: f64 = 1.0;
/// Bricks whose patches are measured before what they found is taken.
const BATCH: usize = 256;

/// Points, and how near the patches so far have come to them.
pub(super) struct Beside<'a> {
    surface: &'a Isosurface<'a>,
    points: &'a [[f64; 3]],
    /// For each brick the points to which a triangle in its cells may be as near as `within`.
    near: BTreeMap<BrickId, Vec<usize>>,
    within: f64,
}

impl<'a> Beside<'a> {
    pub(super) fn new(surface: &'a Isosurface<'a>, points: &'a [[f64; 3]]) -> Self {
        let (grid, geometry) = (*surface.u.set().grid(), surface.geometry);
        let within = BESIDE * geometry.max_spacing();
        let mut near: BTreeMap<BrickId, Vec<usize>> = BTreeMap::new();
        for (n, &point) in points.iter().enumerate() {
            let voxel = geometry.to_voxels(point);
            // The cells of a brick are named by their lowest corners; those beyond the border are of the bricks there.
            let brick = |a: usize, side: f64| {
                let reach = side * (within + surface.farthest()) / geometry.spacing[a] * (1.0 + 1e-9);
                ((voxel[a] + reach).floor() as i64).clamp(0, geometry.shape[a] - 1) / grid.edge()
            };
            let bricks = Box3::new([0, 1, 2].map(|a| brick(a, -1.0)), [0, 1, 2].map(|a| brick(a, 1.0) + 1));
            for (y, z) in bricks.rows() {
                for id in (bricks.lo[0]..bricks.hi[0]).filter_map(|x| grid.id_at([x, y, z])) {
                    near.entry(id).or_default().push(n);
                }
            }
        }
        Self { surface, points, near, within }
    }

    /// Squared distances of the points before any patch has passed: as far as is looked at.
    pub(super) fn none_yet(&self) -> Vec<f64> {
        vec![self.within * self.within; self.points.len()]
    }

    /// How near a patch comes to the points near its brick.
    pub(super) fn nearest_in(&self, id: BrickId, patch: &Patch) -> Vec<f64> {
        let Some(members) = self.near.get(&id) else { return Vec::new() };
        let targets: Vec<[f64; 3]> = members.iter().map(|&n| self.points[n]).collect();
        let due: Vec<usize> = (0..targets.len()).collect();
        let mut squared = vec![self.within * self.within; targets.len()];
        approach(self.surface, patch, &targets, (&due, &mut squared));
        squared
    }

    /// Takes what [`Beside::nearest_in`] found into the squared distances of all points.
    pub(super) fn take(&self, id: BrickId, found: &[f64], squared: &mut [f64]) {
        let members = self.near.get(&id).into_iter().flatten();
        members.zip(found).for_each(|(&n, &found)| squared[n] = squared[n].min(found));
    }

    /// The distances, when all patches have passed: also of the points that lie farther away.
    pub(super) fn distances(&self, stage: &Stage<'_>, squared: &[f64]) -> Result<Vec<Option<f64>>> {
        let is_near = |&squared: &f64| squared < self.within * self.within;
        let mut distances: Vec<Option<f64>> =
            squared.iter().map(|squared| Some(squared.sqrt()).filter(|_| is_near(squared))).collect();
        let rest: Vec<usize> = (0..self.points.len()).filter(|&n| !is_near(&squared[n])).collect();
        let targets: Vec<[f64; 3]> = rest.iter().map(|&n| self.points[n]).collect();
        let found = distances_anywhere(stage, self.surface, &targets)?;
        rest.iter().zip(found).for_each(|(&n, distance)| distances[n] = distance);
        Ok(distances)
    }
}

/// Distances from points to a surface, each exact to the triangles; none when there is no surface.
///
/// # Errors
/// When the run is interrupted.
pub fn distances_to(stage: &Stage<'_>, surface: &Isosurface<'_>, points: &[[f64; 3]]) -> Result<Vec<Option<f64>>> {
    let beside = Beside::new(surface, points);
    let mut squared = beside.none_yet();
    let workers = Workers::new(|| (Pencil::new(), Patch::default()));
    let bricks: Vec<BrickId> = beside.near.keys().copied().filter(|&id| surface.is_in(id)).collect();
    for batch in bricks.chunks(BATCH) {
        let found = stage.run(batch, &workers, |(pencil, patch), &id| {
            surface.patch_of(id, pencil, patch)?;
            Ok(beside.nearest_in(id, patch))
        })?;
        batch.iter().zip(&found).for_each(|(&id, found)| beside.take(id, found, &mut squared));
    }
    beside.distances(stage, &squared)
}
