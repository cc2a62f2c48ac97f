//! The surface u = 1/2 of a solved band as a mesh, with its measures: brick by brick, welded in grid order.

use std::collections::BTreeMap;

use crate::error::Result;
use crate::exec::{Stage, Workers};
use crate::grid::{Box3, BrickGrid, BrickId, Geometry};
use crate::kernel::surface::{
    Hausdorff, MarchingCubes, Measures, Patch, Spread, SurfaceMeasure, Triangle, Welder, cells_of_brick,
};
use crate::store::{BoxSource, BrickArray, MeshSink};

/// Bricks whose patches are made in parallel before they are welded in order.
const BATCH: usize = 256;

/// A surface that was drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drawn {
    /// What it measures.
    pub measures: Measures,
    /// Distances of the points from it; none without points or surface.
    pub hausdorff: Option<Hausdorff>,
    /// How many of the points are how far from it.
    pub spread: Option<Spread>,
    /// Points that are farther from it than they may be.
    pub lost_points: u64,
}

/// Sends the closed surface of `u` to `mesh`; measures it, and how far `points` lie from it, of which those beyond `lost_beyond` are
/// counted.
///
/// # Errors
/// When the sink fails or the run is interrupted.
pub fn draw(
    stage: &Stage<'_>,
    u: &BrickArray<f32>,
    geometry: &Geometry,
    (points, lost_beyond): (&[[f64; 3]], f64),
    mesh: &mut dyn MeshSink,
) -> Result<Drawn> {
    let measures = extract(stage, u, geometry, mesh)?;
    let distances = distances_to(stage, u, geometry, points)?;
    let lost_points = distances.iter().flatten().filter(|&&d| d > lost_beyond).count() as u64;
    let known = || distances.iter().copied().flatten();
    Ok(Drawn { measures, hausdorff: Hausdorff::of(known()), spread: Spread::of(known()), lost_points })
}

/// Sends the closed surface of `u` to `sink` and measures it.
///
/// # Errors
/// When the sink fails or the run is interrupted.
pub fn extract(
    stage: &Stage<'_>,
    u: &BrickArray<f32>,
    geometry: &Geometry,
    sink: &mut dyn MeshSink,
) -> Result<Measures> {
    let grid = *u.set().grid();
    let (lo, hi) = (geometry.origin, geometry.position(geometry.shape));
    let centre = std::array::from_fn(|a| 0.5 * (lo[a] + hi[a]));
    let mut welder = Welder::new(geometry);
    let mut measure = SurfaceMeasure::new(centre);
    let workers = Workers::new(|| (MarchingCubes::new(0.5), Vec::new()));
    // A surface may pass between a brick that is not stored and the one above it, so the bricks below stored ones
    // count.
    let bricks: Vec<BrickId> = (0..grid.len()).filter(|&id| holds_surface(u, id)).collect();
    for batch in bricks.chunks(BATCH) {
        let patches = stage.run(batch, &workers, |(cubes, values), &id| {
            let mut patch = Patch::default();
            patch_of(u, id, cubes, values, &mut patch)?;
            Ok(patch)
        })?;
        for patch in &patches {
            if let Some(kept) = welder.enter_layer(patch) {
                measure.forget_but(&kept);
            }
            welder.add(patch, sink)?;
            welder.triangles_of(patch).for_each(|(corners, positions)| measure.add(corners, positions));
        }
    }
    Ok(measure.measures())
}

/// True unless the brick and all it touches above are constant and equal.
fn holds_surface(u: &BrickArray<f32>, id: BrickId) -> bool {
    let grid = u.set().grid();
    let cells = cells_of_brick(&grid.brick_box(id), grid.shape(), true);
    let part = Box3::new(cells.lo, cells.hi.map(|v| v + 1));
    let reaches_out = part.intersect(&Box3::from_shape(grid.shape())) != part;
    u.constant_in(&part).is_none_or(|value| value >= 0.5 && reaches_out)
}

/// Reads a box that may reach out of the domain, where it is 0.
pub(crate) fn read_padded(u: &BrickArray<f32>, part: &Box3, values: &mut Vec<f32>) -> Result<()> {
    values.clear();
    values.resize(part.len(), 0.0);
    let inside = part.intersect(&Box3::from_shape(u.set().grid().shape()));
    if inside == *part {
        return u.read_box(part, values);
    }
    let mut stored = vec![0.0; inside.len()];
    u.read_box(&inside, &mut stored)?;
    let width = inside.shape()[0] as usize;
    for (row, (y, z)) in stored.chunks_exact(width).zip(inside.rows()) {
        values[part.offset_of([inside.lo[0], y, z])..][..width].copy_from_slice(row);
    }
    Ok(())
}

/// Distances from points to the surface of `u`, each exact to the triangles; none when there is no surface.
///
/// Around the brick of a point, patches are made again in growing shells of bricks until no nearer triangle can come:
/// nothing of the mesh is kept in memory, and most points end in the first shell.
///
/// # Errors
/// When the run is interrupted.
pub fn distances_to(
    stage: &Stage<'_>,
    u: &BrickArray<f32>,
    geometry: &Geometry,
    points: &[[f64; 3]],
) -> Result<Vec<Option<f64>>> {
    let grid = *u.set().grid();
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
        shells.nearest(u, geometry, *brick, &targets)
    })?;
    let mut distances = vec![None; points.len()];
    for ((_, members), group) in groups.iter().zip(found) {
        members.iter().zip(group).for_each(|(&n, distance)| distances[n] = distance);
    }
    Ok(distances)
}

/// Work buffers of the search for the nearest triangle.
struct Shells {
    cubes: MarchingCubes,
    values: Vec<f32>,
    patch: Patch,
}

impl Shells {
    fn new() -> Self {
        Self { cubes: MarchingCubes::new(0.5), values: Vec::new(), patch: Patch::default() }
    }

    fn nearest(
        &mut self,
        u: &BrickArray<f32>,
        geometry: &Geometry,
        brick: BrickId,
        targets: &[[f64; 3]],
    ) -> Result<Vec<Option<f64>>> {
        let grid = *u.set().grid();
        let centre = grid.coords(brick);
        let (mut squared, mut due) = (vec![f64::INFINITY; targets.len()], Vec::new());
        for radius in 0..=grid.counts().into_iter().max().unwrap_or(1) {
            for id in shell(&grid, centre, radius).filter(|&id| holds_surface(u, id)) {
                let (lo, hi) = extent_of(u, geometry, id);
                let away = |target: &[f64; 3]| {
                    (0..3).map(|a| (lo[a] - target[a]).max(target[a] - hi[a]).max(0.0).powi(2)).sum::<f64>()
                };
                due.clear();
                due.extend((0..targets.len()).filter(|&n| away(&targets[n]) < squared[n]));
                if !due.is_empty() {
                    self.measure(u, geometry, id, targets, &due, &mut squared)?;
                }
            }
            // A triangle of a farther shell is at least this far from any point of the brick in the middle.
            let certain = radius as f64 * grid.edge() as f64 * geometry.min_spacing() - 2.0 * geometry.max_spacing();
            if certain > 0.0 && squared.iter().all(|&d| d <= certain * certain) {
                break;
            }
        }
        Ok(squared.into_iter().map(|d| d.is_finite().then(|| d.sqrt())).collect())
    }

    fn measure(
        &mut self,
        u: &BrickArray<f32>,
        geometry: &Geometry,
        id: BrickId,
        targets: &[[f64; 3]],
        due: &[usize],
        squared: &mut [f64],
    ) -> Result<()> {
        patch_of(u, id, &mut self.cubes, &mut self.values, &mut self.patch)?;
        let world = |p: [f64; 3]| std::array::from_fn(|a| geometry.origin[a] + p[a] * geometry.spacing[a]);
        // A triangle lies inside one cube of voxels: from its first corner none of it is farther than that.
        let size = geometry.spacing.iter().map(|h| h * h).sum::<f64>().sqrt() * (1.0 + 1e-9);
        let limit = |squared: f64| (squared.sqrt() + size) * (squared.sqrt() + size);
        let mut limits: Vec<f64> = due.iter().map(|&n| limit(squared[n])).collect();
        for corners in &self.patch.triangles {
            let triangle = Triangle::new(corners.map(|v| world(self.patch.positions[v as usize])));
            let corner = triangle.corner();
            for (&n, near) in due.iter().zip(&mut limits) {
                let (target, nearest) = (&targets[n], &mut squared[n]);
                let away = (0..3).map(|a| (corner[a] - target[a]) * (corner[a] - target[a])).sum::<f64>();
                if away > *near {
                    continue;
                }
                let found = triangle.distance_squared(*target);
                if found < *nearest {
                    (*nearest, *near) = (found, limit(found));
                }
            }
        }
        Ok(())
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

/// The box that the surface in a brick's cells lies in, world coordinates; a little larger, for positions are f32.
fn extent_of(u: &BrickArray<f32>, geometry: &Geometry, id: BrickId) -> ([f64; 3], [f64; 3]) {
    let grid = u.set().grid();
    let cells = cells_of_brick(&grid.brick_box(id), grid.shape(), true);
    let slack = 1e-3 * geometry.max_spacing();
    (geometry.position(cells.lo).map(|v| v - slack), geometry.position(cells.hi).map(|v| v + slack))
}

/// The surface in the cells of one brick.
fn patch_of(
    u: &BrickArray<f32>,
    id: BrickId,
    cubes: &mut MarchingCubes,
    values: &mut Vec<f32>,
    patch: &mut Patch,
) -> Result<()> {
    let grid = *u.set().grid();
    let cells = cells_of_brick(&grid.brick_box(id), grid.shape(), true);
    let part = Box3::new(cells.lo, cells.hi.map(|v| v + 1));
    read_padded(u, &part, values)?;
    cubes.extract(values, &part, &cells, patch);
    Ok(())
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
