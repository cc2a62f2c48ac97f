//! SIGINT, SIGTERM, and SIGHUP, which a terminal sends that is closed: the first asks the run to end in order. A run that has not ended a while after it, since it reads a
//! slow disk or is in a long computation, or is sent a second one, is ended from here, and what it had begun to write is
//! removed. A signal in the midst of that ends the process at once.

use std::process::exit;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::atomic::{AtomicBool, AtomicUsize};
use std::sync::{Arc, LazyLock};
use std::thread;
use std::time::{Duration, Instant};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1, SIGXFSZ};
use signal_hook::flag;

use super::fault::panic_where_asked;
use crate::cli::tell;
use crate::error::{Error, Result};
use crate::exec::Cancel;
use crate::store::remove_unfinished;

/// How often it is looked whether a signal came.
const LOOK: Duration = Duration::from_millis(100);
/// How long a run may take to end in order.
const PATIENCE: Duration = Duration::from_millis(1200);
/// How long it may take where it puts by what it has solved before.
const LONGEST: Duration = Duration::from_millis(9500);

/// True once somebody has said, or is about to say, how the process ends.
static ENDS: AtomicBool = AtomicBool::new(false);
/// The signal that asked for the end, or 0.
static ASKED: AtomicUsize = AtomicUsize::new(0);

/// A flag that the first signal sets.
pub(crate) fn cancel_on_signals() -> Result<Cancel> {
    let cancel = Cancel::default();
    let (again, removing) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
    let hang_up = (!is_ignored(SIGHUP)).then_some(SIGHUP);
    for signal in [SIGINT, SIGTERM].into_iter().chain(hang_up) {
        flag::register_conditional_shutdown(signal, 128 + signal, removing.clone())
            .and_then(|_| flag::register(signal, again.clone()))
            .and_then(|_| flag::register_usize(signal, cancel.flag(), signal as usize))
            .map_err(|error| Error::from_io("cannot listen to signals", &error))?;
    }
    // A file that grows past its limit is then an error of the write, which names the file, and not the end.
    flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)))
        .map_err(|error| Error::from_io("cannot listen to signals", &error))?;
    let (asked, saver) = (cancel.flag(), cancel.clone());
    let watch = move || {
        while asked.load(Relaxed) == 0 {
            thread::sleep(LOOK);
        }
        ASKED.store(asked.load(Relaxed), Relaxed);
        // Of two signals that come before this one is seen.
        again.store(false, Relaxed);
        let seen = Instant::now();
        let mut saved = seen;
        while saved.elapsed() < PATIENCE && seen.elapsed() < LONGEST && !again.load(Relaxed) {
            if saver.is_saving() {
                saved = Instant::now();
            }
            thread::sleep(LOOK);
        }
        if speak_last() {
            removing.store(true, Relaxed);
            end(asked.load(Relaxed));
        }
    };
    thread::Builder::new().spawn(watch).map_err(|error| Error::from_io("cannot listen to signals", &error))?;
    panic_where_asked(&cancel)?;
    Ok(cancel)
}

/// Set by SIGUSR1, with which schedulers say that the end is near: a checkpoint is wanted, and the run goes on.
static WISH: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);

/// From now on SIGUSR1 ends nothing, whether or not there is something to put by.
///
/// # Errors
/// When the system does not allow it.
pub(crate) fn listen_for_wishes() -> Result<()> {
    let listening = flag::register(SIGUSR1, WISH.clone());
    listening.map(drop).map_err(|error| Error::from_io("cannot listen to signals", &error))
}

/// The flag that SIGUSR1 sets.
pub(crate) fn wish() -> Arc<AtomicBool> {
    WISH.clone()
}

/// Whether whoever started the process asked that a signal be passed over, as `nohup` does.
pub(crate) fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

/// Whether the caller is the one who says how the process ends: the first who asks.
pub(crate) fn speak_last() -> bool {
    !ENDS.swap(true, Relaxed)
}

/// What an error is to the user: after a signal, what fails because all goes away is no failure of its own.
pub(crate) fn seen(error: Error) -> Error {
    match ASKED.load(Relaxed) {
        0 => error,
        signal => Error::interrupted(signal as i32),
    }
}

/// Ends the process in the middle of whatever it does.
fn end(signal: usize) -> ! {
    remove_unfinished();
    let error = Error::interrupted(signal as i32);
    tell(&error);
    exit(i32::from(error.exit_code()))
}
