//! The one look at all voxels of a solved distance: chunk by chunk they are read, measured for the report, and handed on to the
//! images that are written; where somebody watches, as soon as a front has passed them.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::early::Early;
use super::field::Solved;
use super::found::DistanceFound;
use super::images::{Buffers, Images};
use super::visit::{Measured, ReadOut, Voxels};
use crate::error::Result;
use crate::exec::{Engine, Stage, Workers, gather_records};
use crate::grid::Box3;
use crate::io::ome_zarr::StoreWriter;
use crate::kernel::distance::features::closest_point::ClosestPoints;
use crate::kernel::distance::features::inside::Inside;
use crate::kernel::distance::repair::bends::MARGIN;
use crate::kernel::distance::state::precision::Precision;
use crate::pipeline::distance::schedule::passing::Passed;
use crate::pipeline::output::pyramid::{visits, visits_of};
use crate::pipeline::output::saved::in_batches;
use crate::pipeline::output::share::{Share, all_threads, largest_shard};

/// Edges of the boxes that voxels are looked at in where nothing is written: as if something was.
const LOOK_EDGES: [[i64; 3]; 2] = [[128; 3], [64; 3]];

/// A distance that is being read out.
pub(crate) struct Reading<'a, P: Precision> {
    what: ReadOut<'a, P>,
    engine: &'a Engine,
    images: Option<Images<'a, P>>,
    inside: Option<Inside<'a>>,
    closest: ClosestPoints<'a>,
    visits: Vec<Vec<Box3>>,
    share: Share<'a>,
    workers: Workers<(Voxels<P>, Buffers<P>)>,
    progress: Mutex<Progress>,
}

/// How far it is.
struct Progress {
    measured: Measured,
    /// Of each visit.
    done: Vec<bool>,
    /// Nothing is read early before that.
    due: Instant,
    /// What was read early has changed.
    reopened: bool,
}

/// Time between two looks at what can be read early, and the visits for each thread that are worth one.
const BETWEEN: Duration = Duration::from_secs(1);
const FEWEST_VISITS: usize = 2;

impl<'a, P: Precision> Reading<'a, P> {
    /// Begins to read out; `store` gets the images, none when it is absent.
    ///
    /// # Errors
    /// When the output cannot be written or scratch runs out.
    pub(crate) fn new(what: ReadOut<'a, P>, engine: &'a Engine, store: Option<&'a StoreWriter>) -> Result<Self> {
        let (geometry, sets) = (what.geometry, what.sets);
        let images = store
            .map(|store| Images::<P>::new(engine, (geometry, what.is_timed), sets, what.wanted, store))
            .transpose()?;
        let threads = all_threads(engine.comm(), engine.threads())?;
        let finest = images.as_ref().map(Images::finest);
        let visits = match &finest {
            Some(finest) => visits(finest.iter().copied(), threads),
            None => visits_of(geometry.domain(), LOOK_EDGES.to_vec(), threads),
        };
        let part = finest.and_then(largest_shard).unwrap_or(LOOK_EDGES[0]);
        let share = Share::new(engine.comm(), &visits, part);
        let done = vec![false; visits.len()];
        let progress = Progress { measured: Measured::default(), done, due: Instant::now(), reopened: false };
        Ok(Self {
            engine,
            images,
            inside: what.is_signed.then(|| Inside::new(geometry, &sets.mesh)),
            closest: ClosestPoints::new(geometry, sets),
            visits,
            share,
            workers: Workers::new(|| (Voxels::default(), Buffers::default())),
            progress: Mutex::new(progress),
            what,
        })
    }

    /// The boxes that this rank of several reads, with those around that tell about them.
    pub(crate) fn reads(&self) -> Vec<Box3> {
        let domain = self.what.geometry.domain();
        // Borders look at the voxels beside, each of which is looked at again.
        let around = |part: &Box3| part.grow(MARGIN + 1).intersect(&domain);
        if self.engine.comm().ranks() == 1 { Vec::new() } else { self.share.chunks().iter().map(around).collect() }
    }

    /// Reads out what was not yet; of several ranks each its share of it.
    ///
    /// # Errors
    /// When the output cannot be written, scratch runs out or the run is interrupted.
    pub(crate) fn finish(&self, solved: &Solved<'_, P>) -> Result<DistanceFound> {
        let stage = self.engine.resumable_stage("read out", 0);
        stage.voxels(self.what.geometry.domain().volume());
        if std::mem::take(&mut self.progress().reopened) {
            self.begin_again();
        }
        let mut measured = std::mem::take(&mut self.progress().measured);
        let rest: Vec<usize> = self.share.own().filter(|&visit| !self.progress().done[visit]).collect();
        match &self.images {
            // What is kept for who asked for it is not in a checkpoint.
            Some(images) if rest.len() == self.visits.len() && self.what.kept.is_none() => {
                in_batches(&stage, &images.all(), &self.visits, &mut measured, |batch, door, measured| {
                    let more = self.read_out(&stage, solved, batch, |visit| door.opens(visit))?;
                    *measured = std::mem::take(measured).and(more);
                    Ok(())
                })?;
            }
            _ => {
                stage.expect(rest.len() as u64);
                measured = measured.and(self.read_out(&stage, solved, &rest, |_| true)?);
            }
        }
        let found =
            self.together(Found { measured, fixed: solved.fixed_voxels, triangles: solved.triangle_distances })?;
        self.describe(found.measured.max)?;
        stage.finish();
        Ok(self.what.found(found.measured, [found.fixed, found.triangles]))
    }

    /// What all ranks have found, once each has written its share.
    fn together(&self, own: Found) -> Result<Found> {
        let comm = self.engine.comm();
        if comm.ranks() == 1 {
            return Ok(own);
        }
        if let Some(images) = &self.images {
            images.all().into_iter().try_for_each(|image| image.join(&self.share))?;
        }
        Ok(gather_records(comm, &own)?.into_iter().fold(Found::default(), Found::and))
    }

    /// Next to never: what was read early is read once more.
    fn begin_again(&self) {
        self.engine.note("distances that were shown have fallen a little since; all are written again");
        let mut progress = self.progress();
        progress.done.fill(false);
        progress.measured = Measured::default();
        self.images.iter().for_each(Images::again);
    }

    fn describe(&self, max: f64) -> Result<()> {
        let low = if self.what.is_signed { -max } else { 0.0 };
        self.images.as_ref().map_or(Ok(()), |images| images.describe([low, max]))
    }

    /// Takes those of some visits that are `wanted`; returns what they measured.
    fn read_out(
        &self,
        stage: &Stage<'_>,
        solved: &Solved<'_, P>,
        visits: &[usize],
        wanted: impl Fn(usize) -> bool + Sync,
    ) -> Result<Measured> {
        let measured = stage.run(visits, &self.workers, |(voxels, buffers), &visit| {
            if !wanted(visit) {
                return Ok(Measured::default());
            }
            self.visits[visit].iter().try_fold(Measured::default(), |before, part| {
                let measured = self.what.measure(part, solved, self.inside.as_ref(), voxels)?;
                if let Some(kept) = self.what.kept {
                    kept.put(&voxels.tile(part, &self.closest));
                }
                if let Some(images) = &self.images {
                    images.put(&voxels.tile(part, &self.closest), buffers)?;
                }
                Ok(before.and(measured))
            })
        })?;
        Ok(measured.into_iter().fold(Measured::default(), Measured::and))
    }

    fn progress(&self) -> MutexGuard<'_, Progress> {
        self.progress.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The visits that can be taken where the front has passed, when it is time to look and they are enough.
    fn passed(&self, passed: &Passed<'_>) -> Vec<usize> {
        let mut progress = self.progress();
        if Instant::now() < progress.due {
            return Vec::new();
        }
        progress.due = Instant::now() + BETWEEN;
        let domain = self.what.geometry.domain();
        let holds = |part: &Box3| passed.holds(&part.grow(MARGIN).intersect(&domain));
        let ready = |visit: &usize| !progress.done[*visit] && self.visits[*visit].iter().all(holds);
        let ready: Vec<usize> = (0..self.visits.len()).filter(ready).collect();
        if ready.len() < FEWEST_VISITS * self.engine.threads() { Vec::new() } else { ready }
    }
}

/// What one rank has found.
#[derive(Default, Serialize, Deserialize)]
struct Found {
    measured: Measured,
    fixed: u64,
    triangles: u64,
}

impl Found {
    fn and(self, other: Self) -> Self {
        let (fixed, triangles) = (self.fixed + other.fixed, self.triangles + other.triangles);
        Self { measured: self.measured.and(other.measured), fixed, triangles }
    }
}

impl<P: Precision> Early<P> for Reading<'_, P> {
    fn passed(&self, passed: &Passed<'_>, solved: &Solved<'_, P>) -> Result<()> {
        let ready = self.passed(passed);
        if ready.is_empty() {
            return Ok(());
        }
        let quiet = self.engine.beside();
        let stage = quiet.stage("read out early", 0);
        let more = self.read_out(&stage, solved, &ready, |_| true)?;
        let mut progress = self.progress();
        progress.measured = std::mem::take(&mut progress.measured).and(more);
        for visit in ready {
            progress.done[visit] = true;
        }
        let max = progress.measured.max;
        drop(progress);
        self.describe(max)
    }

    fn reopened(&self) {
        self.progress().reopened = true;
    }
}
