//! The presmoothing as published: one implicit step of the heat equation, solved by relaxation over cells (Kósa PhD,
//! sec. 3; docs/algorithms.md, "Grey range and presmoothing").

use std::sync::Arc;

use crate::error::Result;
use crate::exec::{
    Boundary, Engine, Exchange, HaloPlan, Place, Reach, Relax, Stage, Waves, Workers, checkerboard, one_wave,
    tell_faces,
};
use crate::grid::{BrickSet, FACES, Slot};
use crate::kernel::image::filter::heat;
use crate::kernel::level_set::cell::{CELL, CELL_LEN};
use crate::kernel::level_set::scheme::mask::CellMask;
use crate::kernel::level_set::scheme::sor::{Halves, Relaxation, relax};
use crate::kernel::level_set::scheme::system::SCHEME_LEN;
use crate::pipeline::level_set::band::read_mask;
use crate::store::{BoxSource, BrickArray};
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
        initial.write_box(&part, values);
        smoothed.write_box(&part, values);
        solved.write_box(&part, &vec![1; values.len()]);
        smoothed.refresh_faces(slot);
        Ok(())
    })?;
    tell_faces(stage.comm(), &smoothed)?;
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
    let exchange = &Exchange::new(stage.comm(), set, &plan)?;
    let workers = &Workers::new(|| (HaloTile::new(CELL), Halves::new(), CellMask::new(), vec![0.0; SCHEME_LEN]));
    let waves = Waves { stage, exchange, workers, waves: &checkerboard(set) };
    let voxels = stage.comm().sum(&[(set.owned().len() * CELL_LEN) as f64])?;
    let mut heat = Heat { smoothed, initial, solved, spacing, sigma, plan, squares: vec![0.0; set.len()] };
    for _ in 0..HEAT_ROUNDS {
        waves.round(&mut heat, Place::before(0.0))?;
        let owned = set.owned();
        let squares = stage.comm().sum(&heat.squares[owned.start as usize..owned.end as usize])?;
        let residual = (squares / voxels).sqrt();
        stage.iterated(HEAT_ITERATIONS as u64, residual);
        if residual < HEAT_TOLERANCE {
            break;
        }
    }
    Ok(())
}

struct Heat<'a> {
    smoothed: &'a BrickArray<f32>,
    initial: &'a BrickArray<f32>,
    solved: &'a BrickArray<u8>,
    spacing: [f64; 3],
    sigma: f64,
    plan: HaloPlan,
    /// Of each cell the sum of the squared corrections when it was last taken up.
    squares: Vec<f64>,
}

impl Relax for Heat<'_> {
    type State = f32;
    type Work = (HaloTile<f32>, Halves, CellMask, Vec<f32>);
    type Visit = f64;
    type Note = [f64; 0];

    fn field(&self) -> &BrickArray<f32> {
        self.smoothed
    }

    /// Every cell is taken up in every round.
    fn priority(&self, _slot: Slot) -> f64 {
        0.0
    }

    fn visit(&self, (tile, halves, mask, scheme): &mut Self::Work, slot: Slot, _wave: usize) -> Result<f64> {
        read_mask(self.solved, slot, mask);
        close_to_absent(self.smoothed.set(), slot, mask);
        self.initial.read(slot, |values| heat::scheme(values, mask, self.spacing, self.sigma, scheme));
        self.plan.gather(self.smoothed, slot, Boundary::Mirror, tile);
        let by = Relaxation { scheme, mask, omega: HEAT_OMEGA, iterations: HEAT_ITERATIONS };
        let correction = relax(tile.data_mut(), halves, by);
        self.plan.scatter(tile, self.smoothed, slot);
        Ok(correction.first)
    }

    fn note(&self, _slot: Slot, _visit: &f64) -> Option<[f64; 0]> {
        Some([])
    }

    fn visited(&mut self, slot: Slot, squares: f64) {
        self.squares[slot as usize] = squares;
    }

    fn receive(&mut self, _slot: Slot, _note: &[f64; 0]) {}
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
