//! How far a run is: the share of it that is done, and the seconds that are left, as far as can be told.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Of what is left beyond the estimate, the part of the time gone that is told: a run that takes longer than was thought is
/// taken to be nearly over, never to be over.
const BEYOND: f64 = 0.1;

/// What a run has behind it and before it.
#[derive(Debug)]
pub struct Outlook {
    begun: Instant,
    known: Mutex<Known>,
}

#[derive(Debug, Default)]
struct Known {
    /// Seconds that the run was thought to take.
    expected: f64,
}

impl Default for Outlook {
    fn default() -> Self {
        Self { begun: Instant::now(), known: Mutex::default() }
    }
}

impl Outlook {
    /// Tells how many seconds the run is thought to take.
    pub fn expect(&self, seconds: f64) {
        self.known().expected = seconds;
    }

    /// The share of the run that is done, 0 to 1; never 1 before it is over.
    #[must_use]
    pub fn done(&self) -> f64 {
        let gone = self.begun.elapsed().as_secs_f64();
        gone / (gone + self.left()).max(f64::MIN_POSITIVE)
    }

    /// The seconds that are left.
    #[must_use]
    pub fn left(&self) -> f64 {
        let gone = self.begun.elapsed().as_secs_f64();
        (self.known().expected - gone).max(BEYOND * gone)
    }

    fn known(&self) -> MutexGuard<'_, Known> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
