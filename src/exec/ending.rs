//! For tests of what can be put by: runs that SIGTERM ends at any moment, and that are gone on with.

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use super::cancel::Cancel;
use super::engine::Engine;
use super::memory::budget::Budget;
use super::progress::heard::Progress;
use super::save_points::SavePoints;
use crate::error::{ErrorKind, Result};
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

/// What a run gave, how many steps it made, and what it said.
type Ran<R> = (Result<R>, usize, String);

fn ran<R>(
    threads: usize,
    checkpoints: Option<(Checkpoints, Option<Duration>)>,
    steps: usize,
    run: &dyn Fn(&Engine) -> Result<R>,
) -> Ran<R> {
    let (folder, cancel) = (tempfile::tempdir().unwrap(), Cancel::default());
    let (left, done, said) = (AtomicUsize::new(steps), AtomicUsize::new(0), Mutex::default());
    let ender = Arc::new(Ender { left, done, signal: cancel.flag(), said });
    let (scratch, budget) = (Scratch::new(folder.path(), 1 << 30), Budget { total: 1 << 30 });
    let saving = checkpoints.map(|(checkpoints, every)| Arc::new(SavePoints::new(checkpoints, every, Arc::default())));
    let engine = Engine::new(threads, scratch, budget, cancel, ender.clone()).unwrap().with_save_points(saving);
    let found = run(&engine);
    let said = ender.said.lock().unwrap().join("; ");
    (found, ender.done.load(Relaxed), said)
}

/// Ends a run at so many moments, evenly spread over it, half of them once more, and goes on with it: each gives what a run gives that
/// nobody ends, with fewer than `most` of the steps where it was ended late. Checkpoints are taken at the end alone, or at every place.
pub(crate) fn check_ended_anywhere<R: PartialEq>(
    what: &str,
    moments: usize,
    most: f64,
    run: &dyn Fn(&Engine) -> Result<R>,
) {
    let (whole, steps, _) = ran(2, None, usize::MAX, run);
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
            let checkpoints = if is_begun {
                let (checkpoints, found) = Checkpoints::resume(&path, Vec::new()).unwrap();
                assert!(found.torn.is_empty(), "{what}: {:?}", found.torn);
                checkpoints
            } else {
                Checkpoints::begin(&path, Vec::new(), false).unwrap()
            };
            let (found, made, said) = ran(threads, Some((checkpoints, every)), end, run);
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
