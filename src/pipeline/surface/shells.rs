//! Distances of points from a surface that lies anywhere: around the brick of a point patches are made in growing shells of bricks until
//! no nearer triangle can come.

use std::collections::BTreeMap;

use super::isosurface::{Isosurface, Pencil};
use super::patch_distance::approach;
use crate::error::Result;
use crate::exec::{Stage, Workers};
use crate::grid::{Box3, BrickGrid, BrickId};
use crate::kernel::surface::Patch;

/// Distances from points to a surface, each exact to the triangles; none when there is no surface.
/// # Errors
/// When the run is interrupted.
pub(super) fn distances_anywhere(
    stage: &Stage<'_>,
    surface: &Isosurface<'_>,
    points: &[[f64; 3]],
) -> Result<Vec<Option<f64>>> {
    let (grid, geometry) = (*surface.u.set().grid(), surface.geometry);
    let shape = geometry.shape;
    let mut by_brick: BTreeMap<BrickId, Vec<usize>> = BTreeMap::new();
    for (n, &point) in points.iter().enumerate() {
        let voxel = geometry.to_voxels(point);
        let inside = std::array::from_fn(|a| (voxel[a].round() as i64).clamp(0, shape[a] - 1));
        by_brick.entry(grid.brick_of(inside).unwrap_or(0)).or_default().push(n);
    }
    let groups: Vec<(BrickId, Vec<usize>)> = by_brick.into_iter().collect();
    let workers = Workers::new(Shells::new);
    let found = stage.run(&groups, &workers, |shells, (brick, members)| {
        let targets: Vec<[f64; 3]> = members.iter().map(|&n| points[n]).collect();
        shells.nearest(surface, *brick, &targets)
    })?;
    let mut distances = vec![None; points.len()];
    for ((_, members), group) in groups.iter().zip(found) {
        members.iter().zip(group).for_each(|(&n, distance)| distances[n] = distance);
    }
    Ok(distances)
}

/// Work buffers of the search for the nearest triangle.
struct Shells {
    pencil: Pencil,
    patch: Patch,
}

impl Shells {
    fn new() -> Self {
        Self { pencil: Pencil::new(), patch: Patch::default() }
    }

    fn nearest(&mut self, surface: &Isosurface<'_>, brick: BrickId, targets: &[[f64; 3]]) -> Result<Vec<Option<f64>>> {
        let (grid, geometry) = (*surface.u.set().grid(), surface.geometry);
        let centre = grid.coords(brick);
        let (mut squared, mut due) = (vec![f64::INFINITY; targets.len()], Vec::new());
        for radius in 0..=grid.counts().into_iter().max().unwrap_or(1) {
            for id in shell(&grid, centre, radius).filter(|&id| surface.is_in(id)) {
                let (lo, hi) = surface.extent_of(id);
                let away = |target: &[f64; 3]| {
                    (0..3).map(|a| (lo[a] - target[a]).max(target[a] - hi[a]).max(0.0).powi(2)).sum::<f64>()
                };
                due.clear();
                due.extend((0..targets.len()).filter(|&n| away(&targets[n]) < squared[n]));
                if !due.is_empty() {
                    surface.patch_of(id, &mut self.pencil, &mut self.patch)?;
                    approach(surface, &self.patch, targets, (&due, &mut squared));
                }
            }
            // A triangle of a farther shell is at least this far from any point of the brick in the middle.
            let slack = 2.0 * geometry.max_spacing() + surface.farthest();
            let certain = radius as f64 * grid.edge() as f64 * geometry.min_spacing() - slack;
            if certain > 0.0 && squared.iter().all(|&d| d <= certain * certain) {
                break;
            }
        }
        Ok(squared.into_iter().map(|d| d.is_finite().then(|| d.sqrt())).collect())
    }
}

/// The bricks of a grid that are `radius` bricks away from one along some axis, and no farther along any.
fn shell(grid: &BrickGrid, centre: [i64; 3], radius: i64) -> impl Iterator<Item = BrickId> {
    let around = Box3::new(centre, centre.map(|c| c + 1)).grow(radius);
    // A stray point far away has a long thin grid: only the part of a shell that lies in it is gone through.
    let inside = around.intersect(&Box3::from_shape(grid.counts()));
    let grid = *grid;
    inside.rows().flat_map(move |(y, z)| {
        let is_face = (y - centre[1]).abs() == radius || (z - centre[2]).abs() == radius;
        let ends = [centre[0] - radius, centre[0] + radius].into_iter().take(if radius == 0 { 1 } else { 2 });
        let whole = inside.lo[0]..if is_face { inside.hi[0] } else { inside.lo[0] };
        let ends = ends.filter(move |x| !is_face && (inside.lo[0]..inside.hi[0]).contains(x));
        whole.chain(ends).filter_map(move |x| grid.id_at([x, y, z]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the plain definition, over all bricks of flat and thick grids.
    #[test]
    fn shells_hold_what_is_as_far_away_and_nothing_twice() {
        for shape in [[7, 1, 1], [5, 4, 3], [1, 6, 9]] {
            let grid = BrickGrid::new(shape.map(|n| 16 * n), 16);
            for centre in (0..grid.len()).map(|id| grid.coords(id)) {
                for radius in 0..10 {
                    let away = |id: &BrickId| {
                        let at = grid.coords(*id);
                        (0..3).map(|a| (at[a] - centre[a]).abs()).max() == Some(radius)
                    };
                    let expected: Vec<BrickId> = (0..grid.len()).filter(away).collect();
                    let mut found: Vec<BrickId> = shell(&grid, centre, radius).collect();
                    found.sort_unstable();
                    assert_eq!(found, expected, "{shape:?} {centre:?} {radius}");
                }
            }
        }
    }
}
