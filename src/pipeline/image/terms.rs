//! The image's part in the velocity: presmoothing and edge detector on the cells around the band.

use std::sync::Arc;

use super::heat_step::heat_step;
use super::smoothing::smoothed;
use crate::error::Result;
use crate::exec::{Boundary, Engine, HaloPlan, Reach, Stage, Workers, equal_part, one_wave, whole_field};
use crate::grid::{Box3, BrickSet};
use crate::kernel::image::filter::edge_detector::edge_detector;
use crate::kernel::level_set::cell::{CELL, CELL_LEN};
use crate::kernel::level_set::scheme::covolume::Planes;
use crate::store::{BoxSource, BrickArray};
use crate::tile::HaloTile;

/// How the image is smoothed before edges are looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Smoothing {
    /// By the exact solution of the heat equation.
    Gaussian,
    /// By one implicit step of it, as published: less smooth, with twice the noise at the same width, and slower.
    Heat,
}

/// How edges are found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeSettings {
    /// Form of the presmoothing.
    pub smoothing: Smoothing,
    /// Width of the presmoothing, a physical length; 0 for none.
    pub sigma: f64,
    /// Contrast parameter K for intensities in [0, 1] and gradients per smallest spacing.
    pub k: f32,
}

/// The edge detector g on the cells of `band`, from the smoothed image on (at least) these cells. Each rank of several does its part of the cells,
/// and all have all of them in the end.
///
/// # Errors
/// When scratch runs out, the run is interrupted or another rank is gone.
///
/// # Panics
/// When a cell of the band was not smoothed.
pub fn edges(
    stage: &Stage<'_>,
    engine: &Engine,
    smoothed: &BrickArray<f32>,
    band: &Arc<BrickSet>,
    spacing: [f64; 3],
    k: f32,
) -> Result<BrickArray<f32>> {
    let own = &Arc::new(equal_part(stage.comm(), band));
    let edges = BrickArray::with_faces(engine.scratch(), own)?;
    let plan = HaloPlan::new(*band.grid(), Reach::All);
    let workers = Workers::new(|| (HaloTile::new(CELL), Planes::new()));
    let length = spacing.iter().copied().fold(f64::INFINITY, f64::min);
    stage.voxels((band.len() * CELL_LEN) as u64);
    stage.run(&one_wave(own), &workers, |(tile, planes), &slot| {
        let wide = smoothed.set().slot(own.id(slot)).expect("smoothed cells cover the band");
        plan.gather(smoothed, wide, Boundary::Mirror, tile);
        edges.write(slot, |g| edge_detector(tile.data(), spacing, length, k, planes, g));
        edges.refresh_faces(slot);
        Ok(())
    })?;
    whole_field(stage, edges, band)
}

/// The smoothed image on (at least) the cells of `band` and those around them, from an image normalised to [0, 1] over
/// the band's grid. Each rank of several smooths its part of the cells, and all have all of them in the end.
///
/// # Errors
/// When the smoothing is too wide, the image cannot be read, scratch runs out, the run is interrupted or another rank is gone.
pub fn presmooth(
    stage: &Stage<'_>,
    engine: &Engine,
    image: &dyn BoxSource<f32>,
    band: &BrickSet,
    spacing: [f64; 3],
    settings: &EdgeSettings,
) -> Result<BrickArray<f32>> {
    let sigma = settings.sigma;
    let cells = match settings.smoothing {
        // One cell more: the edge detector reads a voxel beyond the band, and who looks at its derivatives a few.
        Smoothing::Gaussian => [1; 3],
        Smoothing::Heat => spacing.map(|h| (5.0 * sigma / (h * CELL as f64)).ceil().max(1.0) as i64),
    };
    let set = Arc::new(widened(band, cells));
    let own = Arc::new(equal_part(stage.comm(), &set));
    let part = match settings.smoothing {
        Smoothing::Gaussian => smoothed(stage, engine, image, &own, spacing, [sigma; 3])?,
        Smoothing::Heat => heat_step(stage, engine, image, &own, spacing, sigma)?,
    };
    whole_field(stage, part, &set)
}

/// The set with all cells that lie within so many cells of it along each axis.
fn widened(set: &BrickSet, cells: [i64; 3]) -> BrickSet {
    let grid = *set.grid();
    let mut keep = vec![false; grid.len() as usize];
    for id in set.ids() {
        let at = grid.coords(id);
        let around = Box3::new(
            std::array::from_fn(|a| (at[a] - cells[a]) * CELL as i64),
            std::array::from_fn(|a| (at[a] + cells[a] + 1) * CELL as i64),
        );
        grid.bricks_in(&around).for_each(|id| keep[id as usize] = true);
    }
    BrickSet::from_fn(grid, |id| keep[id as usize])
}
