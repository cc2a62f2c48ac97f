//! Runs that another one of this program has started end with it, also when it is killed: nobody would gather what they make.

use std::process::exit;

/// The variable that tells a run the number of the process that has started it.
pub(crate) const PARENT: &str = "STRANDLINE_PARENT";

/// Asks the system for SIGTERM when the process ends that is named as the parent; without such a name nothing changes.
#[cfg(target_os = "linux")]
pub(crate) fn end_with_parent() {
    use rustix::process::{Signal, getppid, set_parent_process_death_signal};

    let Some(parent) = std::env::var(PARENT).ok().and_then(|number| number.parse::<i32>().ok()) else { return };
    // A system that cannot do so lets the run go on.
    let _ = set_parent_process_death_signal(Some(Signal::TERM));
    // It may have ended before it was asked.
    if getppid().map(|pid| pid.as_raw_nonzero().get()) != Some(parent) {
        exit(128 + Signal::TERM.as_raw());
    }
}

/// Only Linux tells of a parent's end.
#[cfg(not(target_os = "linux"))]
pub(crate) fn end_with_parent() {}
