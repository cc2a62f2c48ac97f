//! The time loop on several ranks: each takes its share of the band's cells, and what they solved is put together.

use std::sync::Arc;

use super::band::Band;
use super::evolve::evolve;
use super::growing::Growing;
use super::time_loop::{Evolution, TimeLoop};
use crate::error::{Error, Result};
use crate::exec::{Engine, HaloPlan, Ownership, Reach, Stage};

/// Moves the surface until it rests, on all ranks of the stage's engine, each with its own cells; no image pulls at it. One rank
/// alone shows it as it grows.
/// The result is in `band.u`.
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
    if stage.ranks() == 1 {
        return evolve(stage, engine, band, None, spacing, settings, growing);
    }
    let set = band.solved.set().clone();
    let ownership = Ownership::balanced(&set, stage.ranks());
    let plan = HaloPlan::new(*set.grid(), Reach::All);
    let whole = &*band;
    let parts = stage.on_ranks(|stage, engine| {
        let own = Arc::new(ownership.part(&set, engine.comm().rank(), &plan));
        let mut part = whole.part(engine, &own)?;
        let done = evolve(stage, engine, &mut part, None, spacing, settings, None)?;
        Ok((part.u, done))
    })?;
    let mut last = None;
    for (u, done) in parts {
        for slot in u.set().owned() {
            if let Some(to) = set.slot(u.set().id(slot)) {
                u.read(slot, |from| band.u.write(to, |to| to.copy_from_slice(from)));
                band.u.refresh_faces(to);
            }
        }
        last = Some(done);
    }
    last.ok_or_else(|| Error::failed("no rank has solved the level set"))
}
