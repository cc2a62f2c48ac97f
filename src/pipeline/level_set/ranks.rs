//! The band on several ranks: each solves its share of the cells, and all have all of them in the end.

use std::sync::Arc;

use super::band::Band;
use super::evolve::evolve;
use super::growing::Growing;
use super::time_loop::{Evolution, TimeLoop};
use crate::error::Result;
use crate::exec::{Engine, Stage, equal_part, part_of, take_parts, whole_field};
use crate::grid::BrickSet;
use crate::store::BrickArray;

/// Moves the surface of a band that all ranks have until it rests, each rank on its own cells, to which `image` may pull it: the edges there, or a
/// speed. One rank alone shows it as it grows. The result is in `band.u`.
///
/// # Errors
/// When scratch runs out, the run is interrupted or a rank ends early.
pub(crate) fn evolve_on_ranks(
    stage: &Stage<'_>,
    engine: &Engine,
    band: &mut Band,
    image: Option<&BrickArray<f32>>,
    spacing: [f64; 3],
    settings: &TimeLoop,
    growing: Option<&mut Growing<'_>>,
) -> Result<Evolution> {
    if engine.comm().ranks() == 1 {
        return evolve(stage, engine, band, image, spacing, settings, growing);
    }
    let own = Arc::new(equal_part(engine.comm(), band.solved.set()));
    let mut part = band.part(engine, &own)?;
    let image = image.map(|image| part_of(engine.scratch(), image, &own)).transpose()?;
    let done = evolve(stage, engine, &mut part, image.as_ref(), spacing, settings, None)?;
    take_parts(stage, &part.u, &band.u)?;
    Ok(done)
}

impl Band {
    /// A rank's own part of a band that it has all of, over its own set of cells.
    fn part(&self, engine: &Engine, own: &Arc<BrickSet>) -> Result<Band> {
        let scratch = engine.scratch();
        let Self { u, distance, solved, voxels } = self;
        let (u, distance) = (part_of(scratch, u, own)?, part_of(scratch, distance, own)?);
        Ok(Band { u, distance, solved: part_of(scratch, solved, own)?, voxels: *voxels })
    }

    /// The band of all ranks, over all its cells `set`, of which this is one rank's part.
    ///
    /// # Errors
    /// When scratch runs out or another rank is gone.
    pub(super) fn whole(self, stage: &Stage<'_>, set: &Arc<BrickSet>) -> Result<Band> {
        let Self { u, distance, solved, voxels } = self;
        let (u, distance) = (whole_field(stage, u, set)?, whole_field(stage, distance, set)?);
        Ok(Band { u, distance, solved: whole_field(stage, solved, set)?, voxels })
    }
}
