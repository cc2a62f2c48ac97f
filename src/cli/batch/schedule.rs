//! Runs items, several at a time, and keeps what came of each.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitStatus;
use std::thread;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, Sender, select, unbounded};
use rustix::process::Signal;

use super::asked::Asked;
use super::child::{Allowed, Before, arguments, code, open_log, peak, reason, signal_all, start, wait};
use super::content;
use super::list::items::Item;
use super::plan::{Pool, Refused};
use super::share::{Free, Waiting, next};
use super::state::{Folder, Stage, State, done_meanwhile, reported};
use super::tell::Teller;
use super::thumbnail;
use crate::cli::outputs::survival::checkpoints_of;
use crate::error::{Error, Result};
use crate::store::checkpoint::Checkpoints;

/// How often it is looked how much memory runs have, and whether a log is free again.
const LOOK: Duration = Duration::from_millis(100);
/// How long a run may take to end that was asked to.
const PATIENCE: Duration = Duration::from_secs(11);
/// How long another batch, which may be ending, is waited for.
const OTHERS: Duration = Duration::from_secs(5);

/// Runs the items of a list.
pub(crate) struct Schedule<'a> {
    pub(crate) folder: &'a Folder,
    pub(crate) items: &'a [Item],
    pub(crate) pool: &'a Pool,
    pub(crate) asked: &'a Asked,
    pub(crate) teller: &'a Teller,
    waiting: Vec<Waiting>,
    running: Vec<Running>,
    ended: (Sender<Ended>, Receiver<Ended>),
    /// Items whose logs another batch has, since when.
    taken: Option<Instant>,
    asked_at: Option<Instant>,
}

struct Running {
    place: usize,
    id: u32,
    memory: u64,
    threads: usize,
    started: Instant,
    peak: u64,
    state: State,
}

struct Ended {
    place: usize,
    status: std::io::Result<ExitStatus>,
    inputs: Vec<content::Input>,
}

/// Whether what lies under an item's names is its batch's own, or nothing is there.
pub(crate) fn check_own(folder: &Folder, item: &Item) -> std::result::Result<(), Refused> {
    let state = folder.state(&item.name);
    let there = |path: &Path| path.symlink_metadata().is_ok();
    let (store, log) = (folder.store(&item.name), folder.log(&item.name));
    let is_made = |path: &PathBuf| state.as_ref().is_some_and(|state| state.made.contains(path));
    let is_logged = state.as_ref().is_some_and(|state| state.owns || state.logged);
    let foreign = if there(&store) && !state.as_ref().is_some_and(|state| state.owns) {
        store
    } else if !is_logged && fs::metadata(&log).is_ok_and(|is| !is.is_file() || is.len() > 0) {
        log
    } else if let Some(file) = item.writes.iter().find(|path| there(path) && !is_made(path)) {
        file.clone()
    } else {
        return Ok(());
    };
    if let Some(State { is_unreadable: true, reason: Some(reason), .. }) = state {
        return Err(Refused { code: 2, reason });
    }
    let foreign = foreign.display();
    let reason = format!("{foreign} is there and not of this batch; move it away, or give the item another `name`");
    Err(Refused { code: 2, reason })
}

/// Whether a run of an item finds what earlier ones made, which it is to replace.
pub(crate) fn is_replacing(folder: &Folder, item: &Item) -> bool {
    let store = folder.store(&item.name);
    std::iter::once(&store).chain(&item.writes).any(|path| path.symlink_metadata().is_ok())
}

/// What a run of an item finds. Only one that was ended is gone on with: one that refused to be would again.
fn before(folder: &Folder, item: &Item) -> Before {
    let has_checkpoints = Checkpoints::lie_in(&checkpoints_of(&folder.store(&item.name)));
    let is_same = |state: State| state.stage == Stage::Interrupted && state.changed_settings(item).is_empty();
    if has_checkpoints && folder.state(&item.name).is_some_and(is_same) {
        Before::Resumed
    } else if has_checkpoints || is_replacing(folder, item) {
        Before::Replaced
    } else {
        Before::Nothing
    }
}

impl<'a> Schedule<'a> {
    /// Of `items` those that wait, in the order in which they are to be run.
    pub(crate) fn new(
        (folder, items): (&'a Folder, &'a [Item]),
        pool: &'a Pool,
        (asked, teller): (&'a Asked, &'a Teller),
        waiting: Vec<Waiting>,
    ) -> Self {
        let (running, ended, taken, asked_at) = (Vec::new(), unbounded(), None, None);
        Self { folder, items, pool, asked, teller, waiting, running, ended, taken, asked_at }
    }

    /// Runs all; `each` hears of every item that has ended.
    ///
    /// # Errors
    /// When what came of an item cannot be kept.
    pub(crate) fn run(mut self, mut each: impl FnMut(usize, &State, f64) -> Result<()>) -> Result<()> {
        loop {
            while !self.asked.is_asked() && self.start_next(&mut each)? {}
            let is_over = self.waiting.is_empty() || self.asked.is_asked();
            if self.running.is_empty() && is_over {
                return Ok(());
            }
            select! {
                recv(self.ended.1) -> ended => if let Ok(ended) = ended {
                    let (place, state) = self.ended(ended)?;
                    each(place, &state, self.left())?;
                },
                recv(self.asked.heard) -> _ => self.heard(),
                default(LOOK) => {}
            }
            for run in &mut self.running {
                run.peak = run.peak.max(peak(run.id).unwrap_or(0));
            }
            if self.asked.ends() && self.asked_at.is_some_and(|since| since.elapsed() > PATIENCE) {
                signal_all(Signal::KILL);
            }
        }
    }

    /// Says what a signal does.
    fn heard(&mut self) {
        if self.asked.ends() {
            self.asked_at.get_or_insert_with(Instant::now);
            self.teller.say("what runs is ended");
        } else {
            let running = self.running.len();
            self.teller.say(&format!("no new items start; {running} still run, and end at a second Ctrl-C"));
        }
    }

    /// Seconds until all is done, by the plans.
    fn left(&self) -> f64 {
        let waiting: f64 = self.waiting.iter().map(|one| one.plan.seconds).sum();
        self.teller.left(waiting, self.running.iter().map(|run| (run.place, run.started)), self.pool.threads)
    }

    /// Starts the next item that fits what is free; returns whether more may.
    fn start_next(&mut self, each: &mut impl FnMut(usize, &State, f64) -> Result<()>) -> Result<bool> {
        let (memory, threads) =
            self.running.iter().fold((0, 0), |(memory, threads), run| (memory + run.memory, threads + run.threads));
        let free = Free {
            memory: self.pool.memory.saturating_sub(memory),
            all_memory: self.pool.memory,
            threads: self.pool.threads.saturating_sub(threads),
            all_threads: self.pool.threads,
        };
        let Some((at, memory, threads)) = next(&self.waiting, &free) else { return Ok(false) };
        let one = self.waiting[at];
        let item = &self.items[one.place];
        let log = self.folder.log(&item.name);
        let opened =
            open_log(&log).map_err(|error| Error::from_io("the log of an item cannot be written", &error).at(&log))?;
        let Some(log) = opened else {
            return self.wait_for_others(at, each);
        };
        self.waiting.remove(at);
        if let Some(state) = done_meanwhile(self.folder, item) {
            each(one.place, &state, self.left())?;
            return Ok(true);
        }
        let before = before(self.folder, item);
        let mut state = State::begun(item, self.folder.state(&item.name));
        (state.memory, state.threads, state.owns) = (Some(memory), Some(threads), true);
        self.folder.keep(&item.name, &state)?;
        let store = self.folder.store(&item.name);
        let allowed = Allowed { memory, threads, scratch: self.pool.scratch.clone() };
        let words = arguments(item, &store, &allowed, before);
        match start(item, &words, log) {
            Ok(child) => self.watch(one.place, child, state, (memory, threads)),
            Err(error) => {
                (state.stage, state.code) = (Stage::Failed, Some(1));
                state.reason = Some(format!("cannot be started: {error}"));
                self.folder.keep(&item.name, &state)?;
                each(one.place, &state, self.left())?;
            }
        }
        Ok(true)
    }

    /// Another batch has an item: it is tried again at the end, and left to that one if it goes on. Returns whether others may
    /// be started.
    fn wait_for_others(&mut self, at: usize, each: &mut impl FnMut(usize, &State, f64) -> Result<()>) -> Result<bool> {
        let one = self.waiting.remove(at);
        let since = *self.taken.get_or_insert_with(Instant::now);
        if since.elapsed() < OTHERS {
            self.waiting.push(one);
            // Not again in this round.
            return Ok(false);
        }
        let mut state = State::begun(&self.items[one.place], None);
        (state.stage, state.reason) = (Stage::Skipped, Some("another batch works on it".into()));
        each(one.place, &state, self.left())?;
        Ok(true)
    }

    fn watch(&mut self, place: usize, mut child: std::process::Child, state: State, (memory, threads): (u64, usize)) {
        let (id, started) = (child.id(), Instant::now());
        self.running.push(Running { place, id, memory, threads, started, peak: 0, state });
        let (files, asked, tell) = (self.items[place].files.clone(), self.asked.clone(), self.ended.0.clone());
        thread::spawn(move || {
            // What the run reads is read once more while the system still has it in memory.
            let inputs = content::read(&files, asked.flag());
            let status = wait(&mut child);
            let _ = tell.send(Ended { place, status, inputs });
        });
    }

    /// Keeps what came of an item that has ended.
    fn ended(&mut self, ended: Ended) -> Result<(usize, State)> {
        let Ended { place, status, inputs } = ended;
        let at = self.running.iter().position(|run| run.place == place);
        let at = at.ok_or_else(|| Error::failed("an item has ended that was not begun"))?;
        let Running { started, peak, mut state, .. } = self.running.remove(at);
        let item = &self.items[place];
        let (store, log) = (self.folder.store(&item.name), self.folder.log(&item.name));
        (state.inputs, state.seconds) = (inputs, Some(started.elapsed().as_secs_f64()));
        state.peak = Some(peak).filter(|&bytes| bytes > 0);
        match status {
            Ok(status) => {
                let was_asked = matches!(code(status), 129 | 130 | 143) || (self.asked.ends() && !status.success());
                state.code = Some(code(status));
                state.stage = match code(status) {
                    0 => Stage::Done,
                    _ if was_asked => Stage::Interrupted,
                    _ => Stage::Failed,
                };
                state.reason = (!status.success()).then(|| reason(status, &log));
                if matches!(state.code, Some(0 | 3)) {
                    state.made.extend(
                        item.writes.iter().filter(|path| !state.made.contains(path)).cloned().collect::<Vec<_>>(),
                    );
                    self.gather(item, &store, &mut state);
                }
            }
            Err(error) => {
                (state.stage, state.reason) = (Stage::Failed, Some(format!("cannot be waited for: {error}")));
            }
        }
        self.folder.keep(&item.name, &state)?;
        self.teller.took(place, state.seconds.unwrap_or(0.0));
        Ok((place, state))
    }

    /// Takes from a store what summaries tell of it.
    fn gather(&self, item: &Item, store: &Path, state: &mut State) {
        if let Some((objects, seconds, peak)) = reported(store) {
            (state.objects, state.seconds, state.peak) = (objects, Some(seconds), Some(peak));
        }
        let picture = self.folder.picture(&item.name);
        // A summary does without a picture.
        let made = thumbnail::of_store(store).and_then(|bytes| fs::write(&picture, bytes).ok());
        if made.is_none() {
            let _ = fs::remove_file(&picture);
        }
    }
}
