//! SIGINT and SIGTERM: the first asks the run to end in order, the second ends it at once.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::{SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::flag;

use crate::error::{Error, Result};
use crate::exec::Cancel;

/// A flag that the first signal sets.
pub(super) fn cancel_on_signals() -> Result<Cancel> {
    let cancel = Cancel::default();
    let again = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        // In this order: the first signal finds `again` unset, sets it, and the second one ends the process.
        flag::register_conditional_shutdown(signal, 128 + signal, again.clone())
            .and_then(|_| flag::register(signal, again.clone()))
            .and_then(|_| flag::register_usize(signal, cancel.flag(), signal as usize))
            .map_err(|error| Error::from_io("cannot listen to signals", &error))?;
    }
    // A file that grows past its limit is then an error of the write, which names the file, and not the end.
    flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)))
        .map_err(|error| Error::from_io("cannot listen to signals", &error))?;
    Ok(cancel)
}
