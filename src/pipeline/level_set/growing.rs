//! What is shown of a surface while it moves: now and then the surface of u, drawn on fewer voxels, as a file that goes when the
//! surface has come to rest.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::error::Result;
use crate::exec::{Engine, Workers};
use crate::grid::{Box3, BrickGrid, BrickSet, Geometry};
use crate::io::geometry::write::ply::PlyWriter;
use crate::io::ome_zarr::{GROWING, StoreWriter};
use crate::pipeline::surface::{Isosurface, extract};
use crate::store::{BoxSource, BrickArray};

/// Voxels that it is drawn on at most: small enough for any viewer.
const MOST_VOXELS: u64 = 2 << 20;
/// Bytes that drawing it takes: the voxels, its patches, what is known of their edges.
const BYTES: u64 = 32 << 20;
/// Time between two drawings, and how many times longer than one takes: it is to cost a fiftieth of the run at most.
const BETWEEN: Duration = Duration::from_millis(500);
const TIMES_LONGER: u32 = 50;

/// The surface of a field that changes.
pub struct Growing<'a> {
    path: PathBuf,
    geometry: &'a Geometry,
    due: Instant,
}

impl<'a> Growing<'a> {
    /// Shown as `growing/NAME.ply` of a store that is live; nothing where it is not.
    ///
    /// # Errors
    /// When its folder cannot be made.
    pub(crate) fn of(store: Option<&StoreWriter>, name: &str, geometry: &'a Geometry) -> Result<Option<Self>> {
        let Some(store) = store.filter(|store| store.live().is_some()) else { return Ok(None) };
        let path = store.file(&format!("{GROWING}/{name}.ply"))?;
        Ok(Some(Self { path, geometry, due: Instant::now() }))
    }

    /// Draws the surface of u = 1/2 as it is, where it is time to. One that cannot be drawn is not shown: the run goes on.
    ///
    /// # Errors
    /// When the run is interrupted.
    pub(crate) fn show(&mut self, engine: &Engine, u: &BrickArray<f32>) -> Result<()> {
        let began = Instant::now();
        if began < self.due {
            return Ok(());
        }
        let _ = self.draw(engine, u);
        self.due = Instant::now() + BETWEEN.max(began.elapsed() * TIMES_LONGER);
        engine.check()
    }

    fn draw(&self, engine: &Engine, u: &BrickArray<f32>) -> Result<()> {
        // Where there is no room for it beside what is solved, it is not shown.
        let Ok(_held) = engine.hold(BYTES) else { return Ok(()) };
        let shape = u.set().grid().shape();
        let step = step_for(shape);
        let quiet = engine.beside();
        let stage = quiet.stage("growing surface", 0);
        let sparse = every(engine, u, step)?;
        let geometry = Geometry {
            shape: sparse.set().grid().shape(),
            spacing: self.geometry.spacing.map(|h| h * step as f64),
            ..self.geometry.clone()
        };
        let mut mesh = PlyWriter::on_grid(&self.path, &geometry)?;
        extract(&stage, &Isosurface::of(&sparse, &geometry), &mut mesh)?;
        mesh.finish()?;
        Ok(())
    }
}

impl Drop for Growing<'_> {
    fn drop(&mut self) {
        // It may never have been drawn. The folder, in which others may grow, goes with the end of the run.
        let _ = std::fs::remove_file(&self.path);
    }
}

/// Each how many voxels of a grid are taken.
fn step_for(shape: [i64; 3]) -> i64 {
    let voxels = |step: i64| shape.iter().map(|&n| sparse_extent(n, step).unsigned_abs()).product::<u64>();
    // A step as long as the longest axis leaves one voxel.
    let longest = shape.into_iter().max().unwrap_or(1);
    (1..=longest).find(|&step| voxels(step) <= MOST_VOXELS).unwrap_or(longest)
}

/// Voxels that are left of an axis.
fn sparse_extent(voxels: i64, step: i64) -> i64 {
    (voxels + step - 1) / step
}

/// The field at each so many voxels along each axis, from the first on.
fn every(engine: &Engine, u: &BrickArray<f32>, step: i64) -> Result<BrickArray<f32>> {
    let shape = u.set().grid().shape().map(|n| sparse_extent(n, step));
    let grid = BrickGrid::new(shape, 32);
    let fine = |part: &Box3| Box3::new(part.lo.map(|v| v * step), part.hi.map(|v| (v - 1) * step + 1));
    let is_empty = |id| u.constant_in(&fine(&grid.brick_box(id))) == Some(0.0);
    let set = Arc::new(BrickSet::from_fn(grid, |id| !is_empty(id)));
    let sparse = BrickArray::new(engine.scratch(), &set)?;
    let quiet = engine.beside();
    let stage = quiet.stage("growing surface", 0);
    let parts: Vec<Box3> = set.owned().map(|slot| grid.brick_box(set.id(slot))).collect();
    stage.run(
        &parts,
        &Workers::new(|| (Vec::new(), Vec::new())),
        |(row, taken): &mut (Vec<f32>, Vec<f32>), part| {
            taken.clear();
            for (y, z) in part.rows() {
                let along = Box3::new([part.lo[0], y, z], [part.hi[0], y + 1, z + 1]);
                let line = fine(&along);
                row.resize(line.len(), 0.0);
                u.read_box(&line, row)?;
                taken.extend(row.iter().step_by(step as usize));
            }
            sparse.write_box(part, taken);
            Ok(())
        },
    )?;
    Ok(sparse)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_are_thinned_to_what_viewers_take() {
        assert_eq!(step_for([128; 3]), 1);
        assert_eq!(step_for([129, 128, 128]), 2);
        assert_eq!(step_for([2048, 2048, 60]), 5);
        assert_eq!([1, 10, 11].map(|n| sparse_extent(n, 5)), [1, 2, 3]);
    }
}
