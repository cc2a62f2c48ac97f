//! For trials of what a run on several ranks leaves: a rank that panics at some moment, as the environment asks.

use std::sync::atomic::Ordering::Relaxed;
use std::thread;
use std::time::Duration;

use crate::error::{Error, Result};
use crate::exec::Cancel;

/// The variable that says which rank of an MPI program is to panic, and after how many seconds: `2 0.5`.
const PANIC: &str = "STRANDLINE_PANIC";
/// What Open MPI calls a rank's number.
const RANK: &str = "OMPI_COMM_WORLD_RANK";

/// Has this process panic where the environment asks for it.
///
/// # Errors
/// When no thread can be started.
pub(crate) fn panic_where_asked(cancel: &Cancel) -> Result<()> {
    let of = |name| std::env::var(name).unwrap_or_default();
    let (asked, rank) = (of(PANIC), of(RANK));
    let moment = asked.split_once(' ').filter(|(of, _)| *of == rank).and_then(|(_, seconds)| seconds.parse().ok());
    let Some(moment) = moment.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok()) else { return Ok(()) };
    let flag = cancel.flag();
    let wait = move || {
        thread::sleep(moment);
        flag.store(Cancel::PANIC, Relaxed);
    };
    thread::Builder::new().spawn(wait).map(drop).map_err(|error| Error::from_io("cannot start a thread", &error))
}
