//! `Cancel`: a flag that a signal handler sets and every loop over bricks looks at.

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use crate::error::{Error, Result};

/// How long a run that is terminated may go on to where a checkpoint can be taken, and take it.
const GRACE: Duration = Duration::from_secs(8);

/// Shared between whoever wants the run to end and the loops that can end it.
#[derive(Clone, Debug, Default)]
pub struct Cancel {
    flag: Arc<AtomicUsize>,
    saving: Arc<Saving>,
}

/// Stages under way that put by what they have solved.
#[derive(Debug, Default)]
struct Saving {
    stages: AtomicUsize,
    /// Those of them that have to go on to where they can.
    going: AtomicUsize,
    /// Since when the end is asked for.
    since: OnceLock<Instant>,
}

impl Cancel {
    /// In the flag in place of a signal: for trials, the run panics.
    pub(crate) const PANIC: usize = 1 << 16;

    /// The number of the signal that asked for the end, or 0; a signal handler may store it there.
    #[must_use]
    pub fn flag(&self) -> Arc<AtomicUsize> {
        self.flag.clone()
    }

    /// Goes on unless the run was asked to end. One that is terminated goes on for a while where a stage under way can put by what
    /// it has solved.
    ///
    /// # Errors
    /// [`crate::error::ErrorKind::Interrupted`] once the flag is set.
    pub fn check(&self) -> Result<()> {
        let goes_on = || self.is_saving() && self.saving.going.load(Relaxed) > 0;
        if self.is_asked() && !goes_on() { self.end() } else { Ok(()) }
    }

    /// Goes on only if the end was not asked for.
    pub(super) fn end(&self) -> Result<()> {
        match self.flag.load(Relaxed) {
            0 => Ok(()),
            Self::PANIC => panic!("a panic was asked for"),
            signal => Err(Error::interrupted(signal as i32)),
        }
    }

    /// Whether it was asked for by a signal after which a run says what it leaves.
    pub(super) fn is_terminated(&self) -> bool {
        self.flag.load(Relaxed) == libc::SIGTERM as usize
    }

    pub(super) fn is_asked(&self) -> bool {
        self.signal() != 0
    }

    /// The signal that asked for it, or 0.
    pub(super) fn signal(&self) -> usize {
        self.flag.load(Relaxed)
    }

    /// Another rank was asked to end, by a signal.
    pub(super) fn ask(&self, signal: usize) {
        let _ = self.flag.compare_exchange(0, signal, Relaxed, Relaxed);
    }

    /// Whether the end was asked for and a stage has yet time to put by what it has solved.
    #[must_use]
    pub fn is_saving(&self) -> bool {
        // The time counts from when the signal is seen first, by whatever stage.
        self.is_terminated()
            && self.saving.since.get_or_init(Instant::now).elapsed() < GRACE
            && self.saving.stages.load(Relaxed) > 0
    }

    /// A stage begins that can put by what it has solved.
    pub(super) fn begin_saving(&self) {
        self.saving.stages.fetch_add(1, Relaxed);
        self.go_on();
    }

    /// It is over.
    pub(super) fn end_saving(&self) {
        self.go_no_farther();
        self.saving.stages.fetch_sub(1, Relaxed);
    }

    /// A stage that can put by what it has solved goes on to where it can, if the end is asked for.
    pub(super) fn go_on(&self) {
        self.saving.going.fetch_add(1, Relaxed);
    }

    /// It can put by what it has, wherever it is.
    pub(super) fn go_no_farther(&self) {
        self.saving.going.fetch_sub(1, Relaxed);
    }
}
