//! What is shown at a moment, looked at again where that is another, and the states of pages, which are kept while it is the same.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock};
use std::time::{Duration, Instant};

use super::choice::Chosen;
use super::present::Present;
use super::shown::Shown;
use super::state;

/// What all answers are made of.
pub(super) struct Site {
    now: RwLock<Arc<Now>>,
}

/// What is shown at a moment.
pub(super) struct Now {
    pub(super) shown: Shown,
    /// The states of pages by the stores that they show, those asked for last.
    states: Mutex<Vec<(String, Arc<str>)>>,
    /// Whether it was live when it was looked at.
    pub(super) is_live: bool,
    /// Whether nothing of it is there any more.
    pub(super) is_gone: bool,
    /// Whether it was taken away while it was written.
    pub(super) is_cut_short: bool,
    /// The stores that were there, and what lay beside them.
    pub(super) present: Vec<Present>,
    listed: Vec<Present>,
    looked: Mutex<Instant>,
}

/// States of pages that are kept.
const MOST_STATES: usize = 4;
/// Time after which it is looked again what there is.
const BETWEEN_LOOKS: Duration = Duration::from_secs(1);

impl Now {
    pub(super) fn new(shown: Shown) -> Self {
        let (states, present) = (Mutex::default(), shown.present());
        let (is_live, listed, looked) = (shown.is_live(), shown.listed(), Mutex::new(Instant::now()));
        Self { shown, states, is_live, is_gone: false, is_cut_short: false, present, listed, looked }
    }

    /// What there is a moment later. What cannot be looked at any more stays as it was seen, and nobody writes it.
    fn next(&self) -> Self {
        self.shown.again().map_or_else(
            |_| {
                let (shown, states) = (self.shown.clone(), Mutex::new(self.known().clone()));
                // What an interrupted run has left before there was anything to show is there.
                let is_gone = shown.live().next().is_none();
                let is_cut_short = is_gone && (self.is_live || self.is_cut_short);
                let (is_live, looked) = (shown.is_live(), Mutex::new(Instant::now()));
                let (present, listed) = (self.present.clone(), self.listed.clone());
                Self { shown, states, is_live, is_gone, is_cut_short, present, listed, looked }
            },
            Self::new,
        )
    }

    fn known(&self) -> MutexGuard<'_, Vec<(String, Arc<str>)>> {
        self.states.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The state of a page that shows a store. Reads meshes, where there is nothing else.
    pub(super) fn state(&self, chosen: &Chosen<'_>) -> Arc<str> {
        if let Some((_, state)) = self.known().iter().find(|(root, _)| root == chosen.root) {
            return state.clone();
        }
        let state: Arc<str> = state::state(chosen).to_string().into();
        let mut known = self.known();
        if known.len() >= MOST_STATES {
            known.remove(0);
        }
        known.push((chosen.root.to_owned(), state.clone()));
        state
    }

    /// Whether it is time to look again, which this is then.
    fn is_due(&self) -> bool {
        let mut looked = self.looked.lock().unwrap_or_else(PoisonError::into_inner);
        let is_due = looked.elapsed() > BETWEEN_LOOKS;
        if is_due {
            *looked = Instant::now();
        }
        is_due
    }
}

impl Site {
    pub(super) fn new(shown: Shown) -> Self {
        Self { now: RwLock::new(Arc::new(Now::new(shown))) }
    }

    pub(super) fn now(&self) -> Arc<Now> {
        self.now.read().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// What is shown, looked at lately. Reads folders.
    pub(super) fn looked_at(&self) -> Arc<Now> {
        let now = self.now();
        // What is broken may be whole when all of it is there.
        let has_changed = || now.shown.present() != now.present || now.shown.listed() != now.listed;
        let is_other = || !now.shown.faults.is_empty() || has_changed();
        if now.is_due() && (now.is_live || now.is_gone || is_other()) {
            *self.now.write().unwrap_or_else(PoisonError::into_inner) = Arc::new(now.next());
        }
        self.now()
    }
}
