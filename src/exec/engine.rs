//! The engine: the one loop over bricks, run on all cores, and its stages.

use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use rayon::prelude::*;

use super::cancel::Cancel;
use super::comm::messages::{Comm, SelfComm};
use super::memory::budget::{Budget, machine_memory, peak_resident};
use super::memory::footprint::{Account, Footprint, Hold};
use super::progress::heard::{OfRank, Progress};
use super::progress::outlook::{Outlook, Running};
use super::progress::report::{Reports, StageReport};
use super::save_points::{By, SavePoint, SavePoints};
use super::workers::Workers;
use crate::error::{Error, ErrorKind, Result};
use crate::store::checkpoint::{Identity, SavedField};
use crate::store::{Scratch, Traffic};

/// Runs kernels over bricks: threads, cancellation, progress, scratch and the account of all that.
pub struct Engine {
    pool: Arc<rayon::ThreadPool>,
    cancel: Cancel,
    progress: Arc<dyn Progress>,
    comm: Arc<dyn Comm>,
    scratch: Scratch,
    budget: Budget,
    account: Arc<Account>,
    outlook: Arc<Outlook>,
    saving: Option<Arc<SavePoints>>,
    reports: Reports,
}

impl Engine {
    /// An engine of `threads` threads with one rank.
    ///
    /// # Errors
    /// When the threads cannot be started.
    pub fn new(
        threads: usize,
        scratch: Scratch,
        budget: Budget,
        cancel: Cancel,
        progress: Arc<dyn Progress>,
    ) -> Result<Self> {
        scratch.set_page_cache(machine_memory().saturating_sub(budget.total) / 2);
        let pool = Arc::new(pool(threads)?);
        let comm = Arc::new(SelfComm);
        let account = Account::new(budget, scratch.clone());
        let (outlook, reports) = (Arc::default(), Reports::default());
        progress.look_out(&outlook);
        Ok(Self { pool, cancel, progress, comm, scratch, budget, account, outlook, saving: None, reports })
    }

    /// The engine of one rank of a run of which all ranks do the same, each on its own part.
    #[must_use]
    pub fn as_rank(self, comm: Arc<dyn Comm>) -> Self {
        Self { comm, ..self }
    }

    /// The engine of a run that puts by what it has solved.
    #[must_use]
    pub fn with_save_points(self, saving: Option<Arc<SavePoints>>) -> Self {
        Self { saving, ..self }
    }

    /// What the run was asked for, and what its inputs hold, where somebody has looked.
    #[must_use]
    pub fn identity(&self) -> Option<&Identity> {
        self.saving.as_ref().map(|saving| saving.identity())
    }

    /// The run is over: what was put by goes, unless the run ended by something that can be mended: a signal, a
    /// full disk, too little memory. A run that is terminated says what it leaves. Where that is nothing, no folder stays.
    pub fn settle_save_points<R>(&self, result: &Result<R>) {
        let is_final = |error: &Error| matches!(error.kind(), ErrorKind::Input | ErrorKind::Vanished);
        if result.is_err() && self.cancel.is_terminated() {
            self.saving.iter().for_each(|saving| saving.tell_of_last(self.progress.as_ref()));
        }
        let is_final = result.as_ref().err().is_none_or(is_final);
        self.saving.iter().filter(|saving| is_final || !saving.are_there()).for_each(|saving| saving.clear());
    }

    /// An engine that shares this one's threads and window, for one of several jobs side by side: it keeps reports of
    /// its own, and says nothing of its stages.
    pub(crate) fn beside(&self) -> Self {
        Self {
            pool: self.pool.clone(),
            cancel: self.cancel.clone(),
            progress: Arc::new(OfRank(self.progress.clone())),
            comm: self.comm.clone(),
            scratch: self.scratch.clone(),
            budget: self.budget,
            account: self.account.clone(),
            outlook: self.outlook.clone(),
            saving: self.saving.clone(),
            reports: Reports::default(),
        }
    }

    /// The same without the other ranks, whose stages are told as those of this one, and which puts by what it solves or nothing.
    pub(super) fn without_others(&self, saves: bool) -> Self {
        let (progress, comm) = (self.progress.clone(), Arc::new(SelfComm));
        let saving = self.saving.clone().filter(|_| saves);
        Self { progress, comm, saving, ..self.beside() }
    }

    /// Whose stages those of this engine are.
    fn by(&self) -> By<'_> {
        By { cancel: &self.cancel, progress: self.progress.as_ref(), comm: self.comm.as_ref() }
    }

    /// Runs on this engine's threads.
    pub(super) fn in_pool<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        self.pool.install(work)
    }

    /// Takes over the reports of stages that were done on an engine beside this one.
    pub(super) fn take_reports(&self, reports: Vec<StageReport>) {
        self.reports.add(reports);
    }

    /// Counts what another rank did in the stages that are finished here, which are those of all ranks.
    pub fn count_rank(&self, done: &[StageReport]) {
        self.reports.count_rank(done);
    }

    /// The threads.
    pub(super) fn pool(&self) -> &rayon::ThreadPool {
        &self.pool
    }

    /// Number of threads.
    #[must_use]
    pub fn threads(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Where fields are stored.
    #[must_use]
    pub fn scratch(&self) -> &Scratch {
        &self.scratch
    }

    /// The run's memory budget.
    #[must_use]
    pub fn budget(&self) -> Budget {
        self.budget
    }

    /// The ranks that run the same program as this engine, each on its own bricks.
    #[must_use]
    pub fn comm(&self) -> &dyn Comm {
        self.comm.as_ref()
    }

    /// Leaves so many bytes of the budget to what a job keeps in memory, the rest to mapped pages, until the guard goes.
    ///
    /// # Errors
    /// When the budget is too small: names the smallest that would do.
    pub fn reserve(&self, footprint: Footprint) -> Result<Hold> {
        self.account.reserve(footprint, self.threads() as u64)
    }

    /// Tells what a box holds that may have grown, or what else a run under way holds; what was reserved for boxes pays for
    /// it first, then mapped pages do.
    ///
    /// # Errors
    /// When the budget is too small: names the smallest that would do.
    pub fn hold(&self, bytes: u64) -> Result<Hold> {
        self.account.hold(bytes)
    }

    /// How far the run is.
    #[must_use]
    pub fn outlook(&self) -> &Arc<Outlook> {
        &self.outlook
    }

    /// Tells the user one line.
    pub fn note(&self, line: &str) {
        self.progress.note(line);
    }

    /// Goes on unless the run was asked to end.
    ///
    /// # Errors
    /// When a signal asked for it.
    pub fn check(&self) -> Result<()> {
        self.cancel.check()
    }

    /// Begins a stage of about `total` steps; the report is made when the stage is finished.
    #[must_use]
    pub fn stage(&self, name: &str, total: u64) -> Stage<'_> {
        self.progress.begin(name, total);
        Stage {
            engine: self,
            planned: self.outlook.begin(name, total),
            started: Instant::now(),
            before: self.scratch.traffic(),
            saves: Saves::Nothing,
            weight: AtomicU64::new(1),
            report: Mutex::new(StageReport { name: name.into(), ..StageReport::default() }),
        }
    }

    /// Begins a stage that can be gone on with: see [`Stage::save_point`]. Of one name there are as many, in the same order, in
    /// every run with the same inputs and settings.
    #[must_use]
    pub fn resumable_stage(&self, name: &str, total: u64) -> Stage<'_> {
        Stage { saves: Saves::Counted, ..self.stage(name, total) }
    }

    /// Begins a stage that can be gone on with as a part of what has a save point; there is one such part.
    #[must_use]
    pub fn stage_within(&self, save_point: Option<&SavePoint<'_>>, part: &str, name: &str, total: u64) -> Stage<'_> {
        let saves = save_point.map_or(Saves::Nothing, |within| Saves::Within(within.part(part)));
        Stage { saves, ..self.stage(name, total) }
    }

    /// Where what has several stages puts by how far it is, if the run does so. The name is as that of a stage that can be gone on
    /// with.
    #[must_use]
    pub fn save_point(&self, name: &str) -> Option<SavePoint<'_>> {
        Some(self.saving.as_ref()?.begin(name, self.by()))
    }

    /// Work on a field with which the first stage of a name has ended, and which it leaves as it is. Where the run is terminated in it,
    /// and that stage has left what it knew ([`SavePoint::leave`]), a checkpoint of both is taken, if none holds them.
    ///
    /// # Errors
    /// Of the work, and when the run is to end.
    pub fn after<R>(&self, stage: &str, field: Option<&dyn SavedField>, work: impl FnOnce() -> Result<R>) -> Result<R> {
        match (&self.saving, field) {
            (Some(saving), Some(field)) => saving.after(stage, field, self.by(), work),
            _ => work(),
        }
    }

    /// What the finished stages cost, in the order they ended.
    #[must_use]
    pub fn reports(&self) -> Vec<StageReport> {
        self.reports.copied()
    }
}

fn pool(threads: usize) -> Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|n| format!("strandline-{n}"))
        .build()
        .map_err(|e| Error::failed(format!("cannot start {threads} threads: {e}")).caused_by(e))
}

/// Whether a stage can be gone on with.
enum Saves {
    /// No.
    Nothing,
    /// As one of so many of its name.
    Counted,
    /// As what has that name alone.
    Within(String),
}

/// A stage under way.
pub struct Stage<'a> {
    engine: &'a Engine,
    planned: Option<Arc<Running>>,
    started: Instant,
    before: Traffic,
    saves: Saves,
    /// Steps that an item counts for in the plan.
    weight: AtomicU64,
    report: Mutex<StageReport>,
}

impl<'a> Stage<'a> {
    /// The engine that it is a stage of.
    #[must_use]
    pub fn engine(&self) -> &'a Engine {
        self.engine
    }

    /// The ranks that take part in this stage.
    #[must_use]
    pub fn comm(&self) -> &'a dyn Comm {
        self.engine.comm()
    }

    /// The one loop over bricks: `work` for each item of a wave, in parallel; results in the wave's order.
    ///
    /// An item is a brick's slot, a shard's box, a plane of a stack: whatever one thread computes in one go.
    ///
    /// # Errors
    /// The first failure of `work`, or the signal that ended the run.
    pub fn run<I, W, R>(
        &self,
        wave: &[I],
        workers: &Workers<W>,
        work: impl Fn(&mut W, &I) -> Result<R> + Sync,
    ) -> Result<Vec<R>>
    where
        I: Sync,
        W: Send,
        R: Send,
    {
        let mut results: Vec<Mutex<Option<R>>> = Vec::new();
        results.resize_with(wave.len(), Mutex::default);
        self.for_each(wave.len(), &|n| {
            let done = workers.with(|worker| work(worker, &wave[n]))?;
            *results[n].lock().unwrap_or_else(PoisonError::into_inner) = Some(done);
            Ok(())
        })?;
        Ok(results.into_iter().filter_map(|done| done.into_inner().unwrap_or_else(PoisonError::into_inner)).collect())
    }

    /// Work for each item of a wave by its number, in parallel. What the threads do to share it out is compiled once here,
    /// not for every kind of work: it was a tenth of the program.
    fn for_each(&self, count: usize, work: &(dyn Fn(usize) -> Result<()> + Sync)) -> Result<()> {
        let (engine, weight) = (self.engine, self.weight.load(Relaxed));
        if count == 0 {
            return engine.cancel.check();
        }
        engine.pool.install(|| {
            (0..count).into_par_iter().try_for_each(|n| {
                engine.cancel.check()?;
                let done = work(n);
                engine.progress.advance(1);
                self.planned.iter().for_each(|planned| planned.advance(weight));
                done
            })
        })?;
        self.report.lock().unwrap_or_else(PoisonError::into_inner).bricks += count as u64;
        Ok(())
    }

    /// Number of threads.
    #[must_use]
    pub fn threads(&self) -> usize {
        self.engine.threads()
    }

    /// Where fields are stored.
    #[must_use]
    pub fn scratch(&self) -> &'a Scratch {
        self.engine.scratch()
    }

    /// Where the stage puts by what it solves, if it is resumable and the run does so. Asked for by what solves, at its start.
    #[must_use]
    pub fn save_point(&self) -> Option<SavePoint<'a>> {
        let (engine, saving) = (self.engine, self.engine.saving.as_ref()?);
        match &self.saves {
            Saves::Nothing => None,
            Saves::Counted => {
                let name = &self.report.lock().unwrap_or_else(PoisonError::into_inner).name;
                Some(saving.begin(name, engine.by()))
            }
            Saves::Within(key) => Some(saving.begin_part(key, engine.by())),
        }
    }

    /// Tells what else the stage holds: see [`Engine::hold`].
    ///
    /// # Errors
    /// When the budget is too small.
    pub fn hold(&self, bytes: u64) -> Result<Hold> {
        self.engine.hold(bytes)
    }

    /// Says what the stage repeated and what was left.
    pub fn iterated(&self, iterations: u64, residual: f64) {
        let mut report = self.report.lock().unwrap_or_else(PoisonError::into_inner);
        report.iterations += iterations;
        report.residual = residual;
    }

    /// Says how many steps the stage has, where that is known only later than its beginning.
    pub fn expect(&self, total: u64) {
        self.planned.iter().for_each(|planned| planned.expect(total));
    }

    /// From now on each item counts for so many of the steps that are expected, as its time is to that of others.
    pub fn weigh(&self, steps: u64) {
        self.weight.store(steps, Relaxed);
    }

    /// Says how many voxels the stage works on.
    pub fn voxels(&self, voxels: u64) {
        self.report.lock().unwrap_or_else(PoisonError::into_inner).voxels = voxels;
    }

    /// Ends the stage and keeps its report.
    pub fn finish(self) -> StageReport {
        let moved = self.engine.scratch.traffic().since(&self.before);
        let mut report = self.report.into_inner().unwrap_or_else(PoisonError::into_inner);
        report.seconds = self.started.elapsed().as_secs_f64();
        report.brick_loads = moved.brick_loads;
        report.bytes_read = moved.bytes_read;
        report.bytes_written = moved.bytes_written;
        report.peak_rss_bytes = peak_resident();
        self.engine.progress.end();
        self.planned.iter().for_each(|planned| self.engine.outlook.end(planned));
        self.engine.reports.add([report.clone()]);
        report
    }
}
