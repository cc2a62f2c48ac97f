//! Ranks inside one process: each a thread with an engine of its own, which runs the same program on its own bricks.

use std::sync::{Arc, Mutex, PoisonError};

use super::comm::messages::Comm;
use super::comm::threads::ThreadComm;
use super::comm::traffic::Counted;
use super::engine::{Engine, Stage};
use super::progress::report::StageReport;
use crate::error::{Error, Result};

impl Stage<'_> {
    /// Runs `work` on each of the engine's ranks, and counts what they do as this stage's. Results are in order of
    /// ranks.
    ///
    /// One rank is the engine itself. Of several, each has its share of the threads and its own files; they share the
    /// window, because they share the memory of one process. What a rank gets from others it gets through its
    /// engine's [`Comm`].
    ///
    /// # Errors
    /// Of the rank that failed first; the others end when they wait for it.
    pub fn on_ranks<R: Send>(&self, work: impl Fn(&Stage<'_>, &Engine) -> Result<R> + Sync) -> Result<Vec<R>> {
        let engine = self.engine();
        if engine.ranks() == 1 {
            return Ok(vec![work(self, engine)?]);
        }
        let done = as_threads(engine.ranks(), |comm| run_rank(engine, &comm, &work))?;
        let (results, reports): (Vec<R>, Vec<StageReport>) = done.into_iter().unzip();
        self.add_ranks(&reports);
        Ok(results)
    }
}

/// Runs `work` on so many ranks that are threads of this process, each connected with all others. Results are in order of ranks.
///
/// # Errors
/// Of the rank that failed first; the others end when they wait for it.
pub fn as_threads<R: Send>(ranks: usize, work: impl Fn(Arc<dyn Comm>) -> Result<R> + Sync) -> Result<Vec<R>> {
    let (work, first_error) = (&work, &Mutex::new(None));
    let fail = |error| _ = first_error.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
    let done: Vec<Option<R>> = std::thread::scope(|scope| {
        let mut started = Vec::new();
        for comm in ThreadComm::connected(ranks) {
            let rank = std::thread::Builder::new().name(format!("strandline-rank-{}", comm.rank()));
            let run = move || {
                let comm: Arc<dyn Comm> = Arc::new(Counted::new(comm));
                let done = work(comm.clone()).map_err(fail).ok();
                // Only now do others learn that this rank is gone, so the first error is the one that ended the run.
                drop(comm);
                done
            };
            match rank.spawn_scoped(scope, run) {
                Ok(rank) => started.push(rank),
                Err(e) => {
                    fail(Error::from_io("cannot start a thread for each rank; give fewer --ranks", &e));
                    break;
                }
            }
        }
        started.into_iter().map(|rank| rank.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))).collect()
    });
    match first_error.lock().unwrap_or_else(PoisonError::into_inner).take() {
        Some(error) => Err(error),
        None => Ok(done.into_iter().flatten().collect()),
    }
}

fn run_rank<R>(
    engine: &Engine,
    comm: &Arc<dyn Comm>,
    work: &(impl Fn(&Stage<'_>, &Engine) -> Result<R> + Sync),
) -> Result<(R, StageReport)> {
    let engine = engine.of_rank(comm.clone())?;
    let stage = engine.stage("rank", 0);
    let result = work(&stage, &engine)?;
    Ok((result, stage.finish()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::ErrorKind;
    use crate::exec::{Budget, Cancel, Silent, Workers};
    use crate::store::Scratch;

    fn engine(ranks: usize, cancel: Cancel) -> Engine {
        let scratch = Scratch::new(&std::env::temp_dir(), 1 << 30);
        let budget = Budget { total: 2 << 30 };
        Engine::new(2, scratch, budget, cancel, Arc::new(Silent)).unwrap().with_ranks(ranks)
    }

    #[test]
    fn what_ranks_do_is_counted_once() {
        for ranks in [1, 2, 3] {
            let engine = engine(ranks, Cancel::default());
            let stage = engine.stage("shared", 0);
            let numbers = stage
                .on_ranks(|stage, engine| {
                    assert_eq!((engine.comm().ranks(), stage.comm().ranks()), (ranks, ranks));
                    assert_eq!(engine.threads(), if ranks == 1 { 2 } else { 1 });
                    stage.run(&[0; 5], &Workers::none(), |(), _| Ok(()))?;
                    stage.iterated(4, 0.5);
                    Ok(engine.comm().rank())
                })
                .unwrap();
            assert_eq!(numbers, (0..ranks).collect::<Vec<_>>());
            let report = stage.finish();
            assert_eq!((report.bricks, report.iterations, report.residual), (5 * ranks as u64, 4, 0.5));
            assert_eq!(engine.reports().len(), 1);
        }
    }

    /// The others wait for a rank that failed, and the error is that rank's own.
    #[test]
    fn a_rank_that_fails_ends_all() {
        for failing in 0..3 {
            let engine = engine(3, Cancel::default());
            let stage = engine.stage("shared", 0);
            let error = stage
                .on_ranks(|_, engine| {
                    engine.comm().any(true)?;
                    if engine.comm().rank() == failing {
                        return Err(Error::failed("no room"));
                    }
                    engine.comm().any(true)
                })
                .unwrap_err();
            assert_eq!(error.to_string(), "no room");
        }
    }

    #[test]
    fn a_rank_that_panics_ends_all() {
        let engine = engine(3, Cancel::default());
        let run = || {
            engine.stage("shared", 0).on_ranks(|_, engine| {
                assert!(engine.comm().rank() != 1, "an invariant of rank 1");
                engine.comm().least(0.0)
            })
        };
        let panic = std::panic::catch_unwind(std::panic::AssertUnwindSafe(run)).unwrap_err();
        assert!(panic.downcast_ref::<&str>().is_some_and(|what| what.contains("an invariant of rank 1")));
    }

    /// One rank sees the signal, all the others wait for it.
    #[test]
    fn a_signal_ends_all() {
        let cancel = Cancel::default();
        let engine = engine(3, cancel.clone());
        let stage = engine.stage("shared", 0);
        let error = stage
            .on_ranks(|_, engine| {
                if engine.comm().rank() == 2 {
                    cancel.flag().store(15, std::sync::atomic::Ordering::Relaxed);
                    engine.check()?;
                }
                engine.comm().sum(&[1.0])
            })
            .unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Interrupted { signal: 15 });
    }
}
