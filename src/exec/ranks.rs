//! Ranks inside one process: each a thread with an engine of its own, which runs the same program on its own bricks.

use std::sync::{Arc, Mutex, PoisonError};

use super::comm::messages::Comm;
use super::comm::threads::ThreadComm;
use super::comm::traffic::Counted;
use crate::error::{Error, Result};

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::ErrorKind;
    use crate::exec::{Budget, Cancel, Engine, Silent, Workers};
    use crate::store::Scratch;

    fn engine(comm: Arc<dyn Comm>, cancel: Cancel) -> Engine {
        let scratch = Scratch::new(&std::env::temp_dir(), 1 << 30);
        let budget = Budget { total: 2 << 30 };
        Engine::new(1, scratch, budget, cancel, Arc::new(Silent)).unwrap().as_rank(comm)
    }

    /// What each rank has counted is joined by the names of stages, also of those that one alone had.
    #[test]
    fn what_ranks_do_is_counted_once() {
        for ranks in [1, 2, 3] {
            let reports = as_threads(ranks, |comm| {
                let (rank, engine) = (comm.rank(), engine(comm, Cancel::default()));
                let names = ["shared".to_owned(), format!("of {rank}"), "shared".to_owned()];
                for (n, name) in names.iter().enumerate() {
                    let stage = engine.stage(name, 0);
                    stage.run(&vec![0; 5 + n], &Workers::none(), |(), _| Ok(()))?;
                    stage.finish();
                }
                Ok((engine.reports(), engine))
            })
            .unwrap();
            let (_, first) = &reports[0];
            reports[1..].iter().for_each(|(reports, _)| first.count_rank(reports));
            let found: Vec<(String, u64)> =
                first.reports().into_iter().map(|stage| (stage.name, stage.bricks)).collect();
            let many = ranks as u64;
            let mut expected = vec![("shared".to_owned(), 5 * many), ("of 0".into(), 6), ("shared".into(), 7 * many)];
            expected.extend((1..ranks).map(|rank| (format!("of {rank}"), 6)));
            assert_eq!(found, expected);
        }
    }

    /// The others wait for a rank that failed, and the error is that rank's own.
    #[test]
    fn a_rank_that_fails_ends_all() {
        for failing in 0..3 {
            let error = as_threads(3, |comm| {
                comm.any(true)?;
                if comm.rank() == failing {
                    return Err(Error::failed("no room"));
                }
                comm.any(true)
            })
            .unwrap_err();
            assert_eq!(error.to_string(), "no room");
        }
    }

    #[test]
    fn a_rank_that_panics_ends_all() {
        let run = || {
            as_threads(3, |comm| {
                assert!(comm.rank() != 1, "an invariant of rank 1");
                comm.least(0.0)
            })
        };
        let panic = std::panic::catch_unwind(std::panic::AssertUnwindSafe(run)).unwrap_err();
        assert!(panic.downcast_ref::<&str>().is_some_and(|what| what.contains("an invariant of rank 1")));
    }

    /// One rank sees the signal, all the others wait for it.
    #[test]
    fn a_signal_ends_all() {
        let cancel = Cancel::default();
        let error = as_threads(3, |comm| {
            let engine = engine(comm.clone(), cancel.clone());
            if comm.rank() == 2 {
                cancel.flag().store(15, std::sync::atomic::Ordering::Relaxed);
                engine.check()?;
            }
            comm.sum(&[1.0])
        })
        .unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Interrupted { signal: 15 });
    }
}
