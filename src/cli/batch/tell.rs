//! What is told while a batch goes on: a row for each item as it ends, and how much time is left.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::time::Instant;

use serde_json::json;

use super::state::State;
use crate::cli::terminal::console::{Console, Voice};
use crate::cli::terminal::log;
use crate::cli::terminal::text::duration;

/// The user's side of a batch.
pub(crate) struct Teller {
    console: Console,
    voice: Voice,
    /// Widest name, for rows.
    width: usize,
    times: RefCell<Times>,
}

/// Seconds that items were said to take with one thread, by their place, and what those that ended took.
#[derive(Default)]
struct Times {
    planned: BTreeMap<usize, f64>,
    said: f64,
    took: f64,
}

impl Teller {
    pub(crate) fn new(voice: Voice, names: impl Iterator<Item = usize>) -> Self {
        Self { console: Console::new(voice), voice, width: names.max().unwrap_or(0).min(40), times: RefCell::default() }
    }

    pub(crate) fn say(&self, line: &str) {
        self.console.say(line);
    }

    /// Hears what items will take.
    pub(crate) fn expect(&self, planned: impl Iterator<Item = (usize, f64)>) {
        self.times.borrow_mut().planned.extend(planned);
    }

    /// Hears what an item took.
    pub(crate) fn took(&self, place: usize, seconds: f64) {
        let mut times = self.times.borrow_mut();
        times.said += times.planned.get(&place).copied().unwrap_or(0.0);
        times.took += seconds;
    }

    /// Seconds until all is done: what was planned, put right by what items took that have ended.
    pub(crate) fn left(&self, waiting: f64, running: impl Iterator<Item = (usize, Instant)>, threads: usize) -> f64 {
        let times = self.times.borrow();
        let pace = if times.said > 0.0 { times.took / times.said } else { 1.0 };
        let of_running = |(place, since): (usize, Instant)| {
            let planned = times.planned.get(&place).copied().unwrap_or(0.0) * pace;
            (planned - since.elapsed().as_secs_f64()).max(0.0)
        };
        let rest: Vec<f64> = running.map(of_running).collect();
        let longest = rest.iter().copied().fold(0.0, f64::max);
        ((waiting * pace + rest.iter().sum::<f64>()) / threads as f64).max(longest).max(0.0)
    }

    /// The row of an item that has ended.
    pub(crate) fn ended(&self, name: &str, state: &State, [ended, all]: [usize; 2], left: f64) {
        let what = state.stage.name();
        if self.voice == Voice::Json {
            log::event(
                "item",
                json!({
                    "item": name, "state": what, "code": state.code, "reason": state.reason, "seconds": state.seconds,
                    "ended": ended, "items": all, "left": left,
                }),
            );
            return;
        }
        let seconds = state.seconds.map_or(String::new(), |seconds| format!("{seconds:8.1} s"));
        let left = if ended < all && left >= 1.0 { format!("  about {} left", duration(left)) } else { String::new() };
        let reason = state.reason.as_ref().map_or(String::new(), |reason| format!("  {reason}"));
        let width = self.width;
        self.say(&format!("{ended:>4}/{all}  {name:width$}  {what:11}{seconds}{left}{reason}"));
    }
}
