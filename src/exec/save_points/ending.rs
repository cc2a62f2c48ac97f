//! For tests of what can be put by: runs that SIGTERM ends at any moment, and that are gone on with, on any number of ranks.

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::{SavePoints, share_checkpoints};
use crate::error::{ErrorKind, Result};
use crate::exec::{Budget, Cancel, Comm, Engine, Progress, as_threads};
use crate::store::Scratch;
use crate::store::checkpoint::Checkpoints;

/// Ends a run after so many steps of any stage.
struct Ender {
    left: AtomicUsize,
    done: AtomicUsize,
    signal: Arc<AtomicUsize>,
    said: Mutex<Vec<String>>,
}

impl Progress for Ender {
    fn begin(&self, _name: &str, _total: u64) {}

    fn advance(&self, steps: u64) {
        self.done.fetch_add(steps as usize, Relaxed);
        if self.left.fetch_sub(steps as usize, Relaxed) == steps as usize {
            self.signal.store(libc::SIGTERM as usize, Relaxed);
        }
    }

    fn note(&self, line: &str) {
        self.said.lock().unwrap().push(line.to_owned());
    }

    fn end(&self) {}
}

/// What a run gave, how many steps the first rank made, and what it said.
type Ran<R> = (Result<R>, usize, String);

/// Threads of a run, or of each of its ranks.
#[derive(Clone, Copy)]
struct Layout {
    threads: usize,
    ranks: usize,
}

/// Runs on ranks that share nothing but the folder of the checkpoints; the first one is ended, and gives what is compared.
fn ran<R: Send>(
    layout: Layout,
    checkpoints: Option<(Checkpoints, Option<Duration>)>,
    steps: usize,
    run: &(dyn Fn(&Engine) -> Result<R> + Sync),
) -> Ran<R> {
    let (checkpoints, every) = checkpoints.unzip();
    let (first, every) = (Mutex::new(checkpoints), every.flatten());
    let enders: Vec<Arc<Ender>> = (0..layout.ranks)
        .map(|rank| {
            let (left, signal) = (if rank == 0 { steps } else { usize::MAX }, Arc::default());
            let (left, done, said) = (AtomicUsize::new(left), AtomicUsize::new(0), Mutex::default());
            Arc::new(Ender { left, done, signal, said })
        })
        .collect();
    let work = |comm: Arc<dyn Comm>| {
        let (rank, folder, cancel) = (comm.rank(), tempfile::tempdir().unwrap(), Cancel::default());
        let (scratch, budget) = (Scratch::new(folder.path(), 1 << 30), Budget { total: 1 << 30 });
        let ender = Arc::new(Relayed { to: enders[rank].clone(), flag: cancel.flag() });
        let engine = Engine::new(layout.threads, scratch, budget, cancel, ender).unwrap().as_rank(comm);
        let found = if rank == 0 { first.lock().unwrap().take() } else { None };
        let found = share_checkpoints(engine.comm(), found)?;
        let saving = found.map(|checkpoints| SavePoints::new(checkpoints, every, Arc::default()));
        run(&engine.with_save_points(saving.map(Arc::new)))
    };
    let found = as_threads(layout.ranks, work).map(|found| found.into_iter().next().unwrap());
    let said = enders[0].said.lock().unwrap().join("; ");
    (found, enders[0].done.load(Relaxed), said)
}

/// Hears of a rank's steps, and passes on the signal to its engine.
struct Relayed {
    to: Arc<Ender>,
    flag: Arc<AtomicUsize>,
}

impl Progress for Relayed {
    fn begin(&self, _name: &str, _total: u64) {}

    fn advance(&self, steps: u64) {
        self.to.advance(steps);
        let signal = self.to.signal.load(Relaxed);
        if signal != 0 {
            self.flag.store(signal, Relaxed);
        }
    }

    fn note(&self, line: &str) {
        self.to.note(line);
    }

    fn end(&self) {}
}

/// Ends a run at so many moments, evenly spread over it, half of them once more, and goes on with it: each gives what a run gives that
/// nobody ends, with fewer than `most` of the steps where it was ended late. Checkpoints are taken at the end alone, or at every place.
pub(crate) fn check_ended_anywhere<R: PartialEq + Send>(
    what: &str,
    moments: usize,
    most: f64,
    run: &(dyn Fn(&Engine) -> Result<R> + Sync),
) {
    let (whole, steps, _) = ran(Layout { threads: 2, ranks: 1 }, None, usize::MAX, run);
    let whole = whole.unwrap();
    assert!(steps > moments, "{what}: {steps} steps");
    for moment in 1..moments {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("c");
        let every = (moment % 2 == 0).then_some(Duration::ZERO);
        let (mut is_begun, mut ends) = (false, vec![usize::MAX, steps * moment / moments]);
        if moment % 4 < 2 {
            ends.insert(1, steps / moments);
        }
        let mut threads = 1;
        while let Some(end) = ends.pop() {
            let checkpoints = begun(what, &path, is_begun);
            let (found, made, said) = ran(Layout { threads, ranks: 1 }, Some((checkpoints, every)), end, run);
            match found {
                Ok(found) => {
                    assert!(found == whole, "{what}, ended at {moment} of {moments}: {said}");
                    let is_late = is_begun && moment > moments / 2;
                    let is_short = (made as f64) < most * steps as f64;
                    assert!(
                        is_short || !is_late,
                        "{what}, ended at {moment} of {moments}: {made} of {steps} steps again"
                    );
                    break;
                }
                Err(error) => {
                    assert!(matches!(error.kind(), ErrorKind::Interrupted { .. }), "{what}: {error}");
                    // Before there is a place at which it can be put by little is lost; one that was put by stands.
                    let is_early = is_begun || moment <= moments * 3 / 4;
                    let is_saved = is_early || said.contains("--resume goes on from it");
                    assert!(is_saved, "{what}, ended at {moment} of {moments}: {said}");
                }
            }
            (is_begun, threads) = (true, 3 - threads);
        }
    }
}

fn begun(what: &str, path: &std::path::Path, is_begun: bool) -> Checkpoints {
    if !is_begun {
        return Checkpoints::begin(path, Vec::new(), false).unwrap();
    }
    let (checkpoints, found) = Checkpoints::resume(path, Vec::new()).unwrap();
    assert!(found.torn.is_empty(), "{what}: {:?}", found.torn);
    checkpoints
}

/// Ends a run on several ranks at so many moments and goes on with it on other numbers of them: all give what one rank gives. `run` gives
/// what is the same on all ranks. Returns how many of the runs that went on had something to go on from.
pub(crate) fn check_ended_on_ranks<R: PartialEq + Send>(
    what: &str,
    moments: usize,
    run: &(dyn Fn(&Engine) -> Result<R> + Sync),
) -> usize {
    let (whole, ..) = ran(Layout { threads: 1, ranks: 1 }, None, usize::MAX, run);
    let whole = whole.unwrap();
    let mut resumed = 0;
    for moment in 1..moments {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("c");
        let every = (moment % 2 == 0).then_some(Duration::ZERO);
        let counts = [[2, 3, 1], [3, 1, 2], [1, 3, 4], [2, 2, 5]][moment % 4];
        for (n, ranks) in counts.into_iter().enumerate() {
            let (_, steps, _) = ran(Layout { threads: 1, ranks }, None, usize::MAX, run);
            // The second time it is ended sooner: then it goes on from what both have put by.
            let end = [steps * moment / moments, steps / moments, usize::MAX][n];
            let checkpoints = begun(what, &path, n > 0);
            resumed += usize::from(n > 0 && checkpoints.are_there());
            let (found, _, said) = ran(Layout { threads: 1, ranks }, Some((checkpoints, every)), end.max(1), run);
            match found {
                Ok(found) => {
                    assert!(found == whole, "{what}, {counts:?} ranks, ended at {moment} of {moments}: {said}");
                    break;
                }
                Err(error) => {
                    assert!(matches!(error.kind(), ErrorKind::Interrupted { .. }), "{what}, {counts:?} ranks: {error}");
                    assert!(end < usize::MAX, "{what}, {counts:?} ranks: nobody ended it");
                }
            }
        }
    }
    resumed
}
