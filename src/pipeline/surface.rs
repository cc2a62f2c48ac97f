//! The surface u = 1/2 of a solved band as a mesh, with its measures: brick by brick, welded in grid order.

use crate::error::Result;
use crate::exec::{Stage, Workers};
use crate::grid::{Box3, BrickId, Geometry};
use crate::kernel::surface::{MarchingCubes, Measures, Patch, SurfaceMeasure, Welder, cells_of_brick};
use crate::store::{BoxSource, BrickArray, MeshSink};

/// Bricks whose patches are made in parallel before they are welded in order.
const BATCH: usize = 256;

/// Sends the closed surface of `u` to `sink` and measures it.
///
/// # Errors
/// When the sink fails or the run is interrupted.
pub fn extract(stage: &Stage<'_>, u: &BrickArray<f32>, geometry: &Geometry, sink: &mut dyn MeshSink) -> Result<Measures> {
    let grid = *u.set().grid();
    let (lo, hi) = (geometry.origin, geometry.position(geometry.shape));
    let centre = std::array::from_fn(|a| 0.5 * (lo[a] + hi[a]));
    let mut welder = Welder::new(geometry);
    let mut measure = SurfaceMeasure::new(centre);
    let shape = geometry.shape;
    let workers = Workers::new(move || (MarchingCubes::new(shape, 0.5), Vec::new()));
    // A surface may pass between a brick that is not stored and the one above it, so the bricks below stored ones count.
    let bricks: Vec<BrickId> = (0..grid.len()).filter(|&id| holds_surface(u, id)).collect();
    for batch in bricks.chunks(BATCH) {
        let patches = stage.run(batch, &workers, |(cubes, values), &id| {
            let cells = cells_of_brick(&grid.brick_box(id), shape, true);
            let part = Box3::new(cells.lo, cells.hi.map(|v| v + 1));
            read_padded(u, &part, values)?;
            let mut patch = Patch::default();
            cubes.extract(values, &part, &cells, &mut patch);
            Ok(patch)
        })?;
        for patch in &patches {
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
fn read_padded(u: &BrickArray<f32>, part: &Box3, values: &mut Vec<f32>) -> Result<()> {
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
