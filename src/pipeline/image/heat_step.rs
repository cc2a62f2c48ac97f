//! The presmoothing as published: one implicit step of the heat equation, solved by relaxation over cells (Kósa PhD,
//! sec. 3; docs/algorithms.md, "Grey range and presmoothing").

use std::sync::Arc;

use crate::error::Result;
use crate::exec::{Boundary, Engine, HaloPlan, Reach, Stage, Workers, checkerboard, one_wave};
use crate::grid::{BrickSet, FACES, Slot};
use crate::kernel::image::filter::heat;
use crate::kernel::level_set::cell::{CELL, CELL_LEN};
use crate::kernel::level_set::scheme::mask::CellMask;
use crate::kernel::level_set::scheme::sor::{Halves, Relaxation, relax};
use crate::kernel::level_set::scheme::system::SCHEME_LEN;
use crate::pipeline::level_set::band::read_mask;
use crate::store::{BoxSink, BoxSource, BrickArray};
use crate::tile::HaloTile;

/// Relaxations of a cell each time it is taken up, over-relaxed by [`HEAT_OMEGA`].
const HEAT_ITERATIONS: usize = 4;
const HEAT_OMEGA: f32 = 1.4;
/// The smoothed image is done when the root mean square of the corrections is below this.
const HEAT_TOLERANCE: f64 = 2e-5;
const HEAT_ROUNDS: usize = 60;

/// One implicit step of the heat equation on the cells of `set`, no flux out of them, from an image normalised to
/// [0, 1] over its grid.
///
/// # Errors
/// When the image cannot be read, scratch runs out or the run is interrupted.
pub(crate) fn heat_step(
    stage: &Stage<'_>,
    engine: &Engine,
    image: &dyn BoxSource<f32>,
    set: &Arc<BrickSet>,
    spacing: [f64; 3],
    sigma: f64,
) -> Result<BrickArray<f32>> {
    let smoothed = BrickArray::with_faces(engine.scratch(), set)?;
    let initial = BrickArray::new(engine.scratch(), set)?;
    let solved = BrickArray::new(engine.scratch(), set)?;
    let grid = *set.grid();
    stage.voxels((set.len() * CELL_LEN) as u64);
    stage.run(&one_wave(set), &Workers::new(|| vec![0.0; CELL_LEN]), |values, &slot| {
        let part = grid.brick_box(set.id(slot));
        let values = &mut values[..part.len()];
        image.read_box(&part, values)?;
        initial.write_box(&part, values)?;
        smoothed.write_box(&part, values)?;
        solved.write_box(&part, &vec![1; values.len()])?;
        smoothed.refresh_faces(slot);
        Ok(())
    })?;
    if sigma > 0.0 {
        relax_heat(stage, set, [&smoothed, &initial], &solved, spacing, sigma)?;
    }
    Ok(smoothed)
}

fn relax_heat(
    stage: &Stage<'_>,
    set: &Arc<BrickSet>,
    [smoothed, initial]: [&BrickArray<f32>; 2],
    solved: &BrickArray<u8>,
    spacing: [f64; 3],
    sigma: f64,
) -> Result<()> {
    let plan = HaloPlan::new(*set.grid(), Reach::Faces);
    let workers = Workers::new(|| (HaloTile::new(CELL), Halves::new(), CellMask::new(), vec![0.0; SCHEME_LEN]));
    let waves = checkerboard(set, |_| true);
    let voxels = (set.len() * CELL_LEN) as f64;
    for _ in 0..HEAT_ROUNDS {
        let mut squares = vec![0.0; set.len()];
        for wave in &waves {
            let corrections = stage.run(wave, &workers, |(tile, halves, mask, scheme), &slot| {
                read_mask(solved, slot, mask);
                close_to_absent(set, slot, mask);
                initial.read(slot, |values| heat::scheme(values, mask, spacing, sigma, scheme));
                plan.gather(smoothed, slot, Boundary::Mirror, tile);
                let by = Relaxation { scheme, mask, omega: HEAT_OMEGA, iterations: HEAT_ITERATIONS };
                let correction = relax(tile.data_mut(), halves, by);
                plan.scatter(tile, smoothed, slot);
                Ok(correction.first)
            })?;
            wave.iter().zip(corrections).for_each(|(&slot, c)| squares[slot as usize] = c);
        }
        let residual = (squares.iter().sum::<f64>() / voxels).sqrt();
        stage.iterated(HEAT_ITERATIONS as u64, residual);
        if residual < HEAT_TOLERANCE {
            break;
        }
    }
    Ok(())
}

/// No flux into cells that are not stored.
fn close_to_absent(set: &BrickSet, slot: Slot, mask: &mut CellMask) {
    for face in FACES {
        if set.neighbour(slot, face.offset()).is_none() {
            let last = if face.upper { CELL - 1 } else { 0 };
            mask.open[face.axis][usize::from(face.upper)][last] = 0.0;
        }
    }
}
