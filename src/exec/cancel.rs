//! `Cancel`: a flag that a signal handler sets and every loop over bricks looks at.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use crate::error::{Error, Result};

/// Shared between whoever wants the run to end and the loops that can end it.
#[derive(Clone, Debug, Default)]
pub struct Cancel(Arc<AtomicUsize>);

impl Cancel {
    /// The number of the signal that asked for the end, or 0; a signal handler may store it there.
    #[must_use]
    pub fn flag(&self) -> Arc<AtomicUsize> {
        self.0.clone()
    }

    /// Goes on unless the run was asked to end.
    ///
    /// # Errors
    /// [`crate::error::ErrorKind::Interrupted`] once the flag is set.
    pub fn check(&self) -> Result<()> {
        match self.0.load(Relaxed) {
            0 => Ok(()),
            signal => Err(Error::interrupted(signal as i32)),
        }
    }
}
