//! Waiting with an end: a test that waits for what never comes fails and says what it was, where it would hold up all others.
#![allow(clippy::unwrap_used)]

use std::process::{Child, Command, Output, Stdio};
use std::sync::mpsc::channel;
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

/// Longer than anything that a test waits for takes, on the slowest machine.
pub(crate) const PATIENCE: Duration = Duration::from_mins(5);

/// Waits until something is so.
pub(crate) fn wait_until(what: &str, mut is_so: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !is_so() {
        assert!(begun.elapsed() < PATIENCE, "waited in vain: {what}");
        thread::sleep(Duration::from_millis(1));
    }
}

/// What a program said that has been started, once it has ended.
pub(crate) fn output_of(child: Child) -> Output {
    let id = Pid::from_child(&child);
    let (tell, told) = channel();
    thread::spawn(move || tell.send(child.wait_with_output()));
    let output = told.recv_timeout(PATIENCE).unwrap_or_else(|_| {
        // Not yet waited for, so that the number is still its own.
        let _ = kill_process(id, Signal::KILL);
        panic!("process {} did not end", id.as_raw_nonzero());
    });
    output.unwrap()
}

/// Runs a program to its end.
pub(crate) fn run(command: &mut Command) -> Output {
    let child = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    output_of(child.unwrap_or_else(|error| panic!("{command:?}: {error}")))
}
