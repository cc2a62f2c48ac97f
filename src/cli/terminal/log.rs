//! `--log json`: what a run tells, one JSON object a line on stderr, for schedulers and programs.

use std::io::{Write, stderr};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use serde_json::{Value, json};

use crate::error::Error;

/// Of the whole process: so are its errors.
static IS_JSON: AtomicBool = AtomicBool::new(false);

/// From now on events are lines of JSON.
pub(crate) fn be_json() {
    IS_JSON.store(true, Relaxed);
}

/// Whether events are lines of JSON.
pub(crate) fn is_json() -> bool {
    IS_JSON.load(Relaxed)
}

/// Tells an event, with what belongs to it.
pub(crate) fn event(name: &str, mut what: Value) {
    what["event"] = name.into();
    // Nobody is left to tell when stderr is closed.
    let _ = writeln!(stderr(), "{what}");
}

/// Tells what a run would take, where that is asked for: bytes of memory that it must be allowed at least, of temporary fields, and
/// of output before compression; and seconds.
pub(crate) fn plan(least_memory: u64, scratch: u64, output: u64, seconds: f64) {
    if is_json() {
        event("plan", json!({ "least_memory": least_memory, "scratch": scratch, "output": output, "time": seconds }));
    }
}

/// Tells that a run is done, where that is asked for.
pub(crate) fn success() {
    if is_json() {
        event("done", json!({ "code": 0 }));
    }
}

/// Tells how a run ended that failed.
pub(crate) fn failure(error: &Error) {
    event("error", json!({ "text": error.to_string(), "code": error.exit_code() }));
}
