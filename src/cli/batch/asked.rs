//! Signals to a batch. The first SIGINT lets what runs end and starts nothing more; the second one, and SIGTERM and SIGHUP, are
//! passed on to all that runs, as is SIGUSR1, which asks for checkpoints. A SIGHUP that whoever started the batch passes over
//! is passed over here too.

use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::atomic::{AtomicBool, AtomicI32};
use std::thread;

use crossbeam_channel::{Receiver, unbounded};
use rustix::process::Signal;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1};
use signal_hook::iterator::Signals;

use super::child::{ask_for_checkpoints, signal_all};
use crate::cli::terminal::signals::is_ignored;
use crate::error::{Error, Result};

/// What was asked so far.
#[derive(Clone, Debug)]
pub(crate) struct Asked {
    /// The first signal, or 0.
    signal: Arc<AtomicI32>,
    /// What runs is to end.
    ends: Arc<AtomicBool>,
    /// A word for each signal.
    pub(crate) heard: Receiver<()>,
}

impl Asked {
    /// Listens from now on.
    ///
    /// # Errors
    /// When the system does not let it.
    pub(crate) fn listen() -> Result<Self> {
        let fault = |error: std::io::Error| Error::from_io("cannot listen to signals", &error);
        let hang_up = (!is_ignored(SIGHUP)).then_some(SIGHUP);
        let mut signals = Signals::new([SIGINT, SIGTERM, SIGUSR1].into_iter().chain(hang_up)).map_err(fault)?;
        let (tell, heard) = unbounded();
        let asked = Self { signal: Arc::default(), ends: Arc::default(), heard };
        let (signal, ends) = (asked.signal.clone(), asked.ends.clone());
        let watch = move || {
            for one in signals.forever() {
                if one == SIGUSR1 {
                    ask_for_checkpoints();
                    continue;
                }
                let is_first = signal.compare_exchange(0, one, Relaxed, Relaxed).is_ok();
                if one != SIGINT || !is_first {
                    ends.store(true, Relaxed);
                    signal_all(if one == SIGINT { Signal::INT } else { Signal::TERM });
                }
                let _ = tell.send(());
            }
        };
        thread::Builder::new().spawn(watch).map_err(fault)?;
        Ok(asked)
    }

    /// The signal that asked for the end.
    pub(crate) fn signal(&self) -> Option<i32> {
        Some(self.signal.load(Relaxed)).filter(|&signal| signal != 0)
    }

    /// Whether what runs is to end.
    pub(crate) fn ends(&self) -> bool {
        self.ends.load(Relaxed)
    }

    /// The same as a flag.
    pub(crate) fn flag(&self) -> &AtomicBool {
        &self.ends
    }

    /// Whether nothing new is to be begun.
    pub(crate) fn is_asked(&self) -> bool {
        self.signal().is_some()
    }
}
