//! What items would take, by their own word: each is asked with `--dry-run`, several at a time, before any runs.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicUsize;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Condvar, Mutex, PoisonError};
use std::thread;

use serde_json::Value;

use super::asked::Asked;
use super::child::{Allowed, Before, arguments, ask, code};
use super::list::Kind;
use super::list::items::Item;
use crate::cli::terminal::text::bytes;

/// Memory of a run that only looks at its inputs.
const LOOKING: u64 = 32 << 20;
/// Bytes of memory for each of a file of points or triangles that is read to be looked at.
const READ: u64 = 8;

/// What an item takes with one thread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plan {
    /// Bytes of memory that it must be allowed.
    pub(crate) least: u64,
    /// Bytes of temporary fields, and of output before compression.
    pub(crate) disk: u64,
    pub(crate) seconds: f64,
}

/// Why an item will not run.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Refused {
    pub(crate) code: i32,
    pub(crate) reason: String,
}

/// What all items have together.
#[derive(Clone, Debug)]
pub(crate) struct Pool {
    pub(crate) memory: u64,
    pub(crate) threads: usize,
    pub(crate) scratch: Option<PathBuf>,
}

impl Pool {
    /// What an item may have at most.
    pub(crate) fn most(&self, item: &Item) -> u64 {
        item.memory.map_or(self.memory, |memory| memory.min(self.memory))
    }
}

/// Does something for each of many, several at a time; nothing more once the end was asked for, and then `None`.
pub(crate) fn each<T: Sync, R: Send>(
    all: &[T],
    threads: usize,
    asked: &Asked,
    work: impl Fn(&T) -> R + Sync,
) -> Vec<Option<R>> {
    let (next, found) = (AtomicUsize::new(0), Mutex::new(all.iter().map(|_| None).collect::<Vec<_>>()));
    let run = || {
        while !asked.is_asked() {
            let at = next.fetch_add(1, Relaxed);
            let Some(one) = all.get(at) else { return };
            let made = work(one);
            found.lock().unwrap_or_else(PoisonError::into_inner)[at] = Some(made);
        }
    };
    thread::scope(|scope| {
        for _ in 1..threads.min(all.len()) {
            scope.spawn(run);
        }
        run();
    });
    found.into_inner().unwrap_or_else(PoisonError::into_inner)
}

/// Asks all items what they would take. `output` is a folder that is there, and `is_replacing` says whose stores may go.
pub(crate) fn plans(
    items: &[(&Item, bool)],
    output: &Path,
    pool: &Pool,
    asked: &Asked,
) -> Vec<Option<Result<Plan, Refused>>> {
    let room = Room { free: Mutex::new(pool.memory), given_back: Condvar::new() };
    each(items, pool.threads, asked, |&(item, is_replacing)| {
        let taken = room.take(looking(item).min(pool.memory));
        let made = plan(item, output, pool, is_replacing);
        room.give_back(taken);
        made
    })
}

/// Memory that is shared out.
struct Room {
    free: Mutex<u64>,
    given_back: Condvar,
}

impl Room {
    fn take(&self, bytes: u64) -> u64 {
        let free = self.free.lock().unwrap_or_else(PoisonError::into_inner);
        let mut free = self.given_back.wait_while(free, |free| *free < bytes).unwrap_or_else(PoisonError::into_inner);
        *free -= bytes;
        bytes
    }

    fn give_back(&self, bytes: u64) {
        *self.free.lock().unwrap_or_else(PoisonError::into_inner) += bytes;
        self.given_back.notify_all();
    }
}

/// Memory that looking at an item's inputs takes, about: images are not read for that, points and triangles are.
fn looking(item: &Item) -> u64 {
    let read = item.files.iter().skip(usize::from(item.kind == Kind::Segment));
    let length = |path: &PathBuf| std::fs::metadata(path).map_or(0, |is| if is.is_file() { is.len() } else { 0 });
    LOOKING + READ * read.map(|(_, path)| length(path)).sum::<u64>()
}

fn plan(item: &Item, output: &Path, pool: &Pool, is_replacing: bool) -> Result<Plan, Refused> {
    let most = pool.most(item);
    let allowed = Allowed { memory: most, threads: 1, scratch: pool.scratch.clone() };
    // A name that nobody has: whether the store's own may be replaced is decided elsewhere.
    let store = output.join(format!(".batch-plan-{}.zarr", item.name));
    let before = if is_replacing { Before::Replaced } else { Before::Nothing };
    let (status, said) = ask(item, &arguments(item, &store, &allowed, before))
        .map_err(|error| Refused { code: 1, reason: format!("cannot be started: {error}") })?;
    let events: Vec<Value> = said.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
    let event = |name: &str| events.iter().find(|event| event["event"] == name);
    let plan = event("plan").and_then(|event| {
        Some(Plan {
            least: event["least_memory"].as_u64()?,
            disk: event["scratch"].as_u64()?.saturating_add(event["output"].as_u64()?),
            seconds: event["time"].as_f64()?,
        })
    });
    match plan {
        Some(plan) if plan.least > most => {
            let reason = format!(
                "needs {} of memory at least, and may have {}; give the batch --memory of {} or more, or a part of it",
                bytes(plan.least),
                bytes(most),
                bytes(plan.least + pool_share())
            );
            Err(Refused { code: 2, reason })
        }
        Some(plan) if status.success() => Ok(plan),
        _ => {
            let told = event("error").and_then(|event| event["text"].as_str());
            let last =
                || said.lines().rfind(|line| !line.starts_with('{')).unwrap_or("ended without a word").to_owned();
            Err(Refused {
                code: code(status),
                reason: told.map_or_else(last, str::to_owned).replace(".batch-plan-", ""),
            })
        }
    }
}

/// Memory of the batch itself, which items do not get.
pub(crate) fn pool_share() -> u64 {
    32 << 20
}
