//! The time loop on several ranks: each takes its share of the band's cells, and all have all of them in the end.

use std::sync::Arc;

use super::band::Band;
use super::evolve::evolve;
use super::growing::Growing;
use super::time_loop::{Evolution, TimeLoop};
use crate::error::Result;
use crate::exec::{Engine, HaloPlan, Ownership, Reach, Stage, borrow_bricks};
use crate::grid::BrickId;
use crate::store::BrickArray;

/// Moves the surface of a band that all ranks have until it rests, each rank on its own cells; no image pulls at it. One rank alone shows it
/// as it grows. The result is in `band.u`.
///
/// # Errors
/// When scratch runs out, the run is interrupted or a rank ends early.
pub(crate) fn evolve_on_ranks(
    stage: &Stage<'_>,
    engine: &Engine,
    band: &mut Band,
    spacing: [f64; 3],
    settings: &TimeLoop,
    growing: Option<&mut Growing<'_>>,
) -> Result<Evolution> {
    let comm = engine.comm();
    if comm.ranks() == 1 {
        return evolve(stage, engine, band, None, spacing, settings, growing);
    }
    let set = band.solved.set().clone();
    let ownership = Ownership::balanced(&set, comm.ranks());
    let own = Arc::new(ownership.part(&set, comm.rank(), &HaloPlan::new(*set.grid(), Reach::All)));
    let mut part = band.part(engine, &own)?;
    let done = evolve(stage, engine, &mut part, None, spacing, settings, None)?;
    take_over(&part.u, &band.u);
    let of_others: Vec<BrickId> = set.ids().filter(|&id| ownership.owner(id) != comm.rank()).collect();
    if let Some(borrowed) = borrow_bricks(stage, &part.u, 0.0, &of_others)? {
        take_over(&borrowed, &band.u);
    }
    Ok(done)
}

/// Copies the cells of a part.
fn take_over(part: &BrickArray<f32>, u: &BrickArray<f32>) {
    for slot in part.set().owned() {
        if let Some(to) = u.set().slot(part.set().id(slot)) {
            part.read(slot, |from| u.write(to, |to| to.copy_from_slice(from)));
            u.refresh_faces(to);
        }
    }
}
