//! The program, held at a line of what it says, so that a test can act there without guessing at times.
//!
//! Its stderr is a pipe with room for one write (`O_DIRECT`, one page: see pipe(7)). While that write is not taken out
//! the next one blocks: a line that begins to be said is seen, and whoever says it does not get past the next one.
#![allow(clippy::unwrap_used)]

use std::fs::File;
use std::io::Read;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::pipe::{PipeFlags, fcntl_setpipe_size, pipe_with};

use super::patience::{PATIENCE, output_of};

/// The most that a pipe takes as one write.
const WRITE: usize = 4096;

/// A program under way.
pub(crate) struct Held {
    child: Child,
    ear: File,
    said: Vec<u8>,
}

/// How it ended.
pub(crate) struct Ended {
    pub(crate) status: ExitStatus,
    /// What it said since it was held or heard last.
    pub(crate) said: String,
    /// What it wrote to stdout.
    pub(crate) printed: String,
}

impl Held {
    pub(crate) fn start(mut command: Command) -> Self {
        let (ear, mouth) = pipe_with(PipeFlags::DIRECT | PipeFlags::CLOEXEC).unwrap();
        fcntl_setpipe_size(&mouth, 1).unwrap();
        let child = command.stdout(Stdio::piped()).stderr(mouth).spawn().unwrap();
        Self { child, ear: ear.into(), said: Vec::new() }
    }

    /// Lets it go on until it begins to say line `number`, counted from 0.
    pub(crate) fn hold_at(&mut self, number: usize) {
        while String::from_utf8_lossy(&self.said).matches('\n').count() < number {
            assert!(self.take() > 0, "ended before line {number}: {}", String::from_utf8_lossy(&self.said));
        }
        assert!(self.speaks(PATIENCE), "neither line {number} nor the end came");
        self.said.clear();
    }

    /// Lets it go on until it has said some words.
    pub(crate) fn hear(&mut self, words: &str) {
        while !String::from_utf8_lossy(&self.said).contains(words) {
            assert!(self.take() > 0, "ended before {words:?}: {}", String::from_utf8_lossy(&self.said));
        }
        self.said.clear();
    }

    /// Lets it go on, whatever it says, until something is so.
    pub(crate) fn go_on_until(&mut self, what: &str, mut is_so: impl FnMut(&Self) -> bool) {
        let begun = Instant::now();
        while !is_so(self) {
            let said = String::from_utf8_lossy(&self.said);
            assert!(begun.elapsed() < PATIENCE, "waited in vain: {what}: {said}");
            if self.speaks(Duration::from_millis(1)) {
                assert!(self.take() > 0, "ended before this: {what}: {}", String::from_utf8_lossy(&self.said));
            }
        }
    }

    pub(crate) fn signal(&self, name: &str) {
        let sent = Command::new("kill").args(["-s", name, &self.child.id().to_string()]).status().unwrap();
        assert!(sent.success());
    }

    /// Lets it go on to its end.
    pub(crate) fn finish(mut self) -> Ended {
        while self.take() > 0 {}
        let output = output_of(self.child);
        let said = String::from_utf8(self.said).unwrap();
        Ended { status: output.status, said, printed: String::from_utf8(output.stdout).unwrap() }
    }

    /// Whether within some time there is a write to take, or the end.
    fn speaks(&self, within: Duration) -> bool {
        let mut ears = [PollFd::new(&self.ear, PollFlags::IN)];
        let within = Timespec::try_from(within).unwrap();
        poll(&mut ears, Some(&within)).unwrap();
        !ears[0].revents().is_empty()
    }

    /// Takes one write out of the pipe; returns its bytes, 0 when there will be none any more.
    fn take(&mut self) -> usize {
        if !self.speaks(PATIENCE) {
            let _ = self.child.kill();
            panic!("it neither went on nor ended: {}", String::from_utf8_lossy(&self.said));
        }
        let mut write = [0; WRITE];
        let len = self.ear.read(&mut write).unwrap();
        self.said.extend_from_slice(&write[..len]);
        len
    }
}
