//! When a run puts by what it has solved, and what a stage finds that goes on from there.
//!
//! A stage that can be gone on with asks for a [`SavePoint`] when it begins and tells it whenever what it has is consistent: at
//! the end of a round, of a time step, of itself. There a checkpoint is taken if it is time for one, if a signal asked for it,
//! or before the run ends by SIGTERM. Where several ranks work on a stage all of them tell at the same places, and take one together; what
//! a rank does by itself it puts by without the others.

use std::collections::HashMap;
use std::io;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde::Serialize;

use super::saved::Saved;
use crate::error::{Error, ErrorKind, Result};
use crate::exec::cancel::Cancel;
use crate::exec::comm::messages::{Comm, SelfComm};
use crate::exec::progress::heard::Progress;
use crate::grid::digits::bytes;
use crate::store::checkpoint::{Checkpoints, Identity, Linked, SavedField, Taken, pack};

/// How often checkpoints are taken where nobody says.
const EVERY: Duration = Duration::from_mins(10);
/// A run that has gone on for less loses little.
const SHORT: Duration = Duration::from_secs(30);
/// Where nobody says how often, checkpoints take at most one in so many seconds.
const SHARE: u32 = 40;
/// Bytes a second that a disk takes, before one is known.
const RATE: f64 = 300e6;

/// Where and how often a run puts by what it has solved.
pub struct SavePoints {
    checkpoints: Checkpoints,
    every: Option<Duration>,
    begun: Instant,
    /// Set by whoever wants a checkpoint now.
    wish: Arc<AtomicBool>,
    /// How often that was.
    wishes: AtomicUsize,
    /// How often stages of each name began: they do so in the same order in every run.
    stages: Mutex<HashMap<String, u32>>,
    /// Time and bytes of all checkpoints so far.
    spent: Mutex<(Duration, u64)>,
    /// Why the last one could not be taken, where it was told.
    failure: Mutex<Option<io::ErrorKind>>,
    /// What stages ended with that left it for those after them.
    left: Mutex<HashMap<String, Left>>,
    /// A run that was asked to end has said which checkpoint there is.
    is_answered: AtomicBool,
}

/// What a stage ended with: what it knew, packed, and whether the last checkpoint holds that.
struct Left {
    facts: Vec<u8>,
    stands: bool,
}

impl SavePoints {
    /// `every` says how often, whatever it costs; `wish` asks for one now.
    #[must_use]
    pub fn new(checkpoints: Checkpoints, every: Option<Duration>, wish: Arc<AtomicBool>) -> Self {
        Self {
            checkpoints,
            every,
            begun: Instant::now(),
            wish,
            wishes: AtomicUsize::new(0),
            stages: Mutex::default(),
            spent: Mutex::default(),
            failure: Mutex::default(),
            left: Mutex::default(),
            is_answered: AtomicBool::new(false),
        }
    }

    /// What the run was asked for, and what its inputs hold.
    #[must_use]
    pub fn identity(&self) -> &Identity {
        self.checkpoints.identity()
    }

    /// Whether there is a checkpoint, of this run or of the one that it goes on with.
    pub(in crate::exec) fn are_there(&self) -> bool {
        self.checkpoints.are_there()
    }

    /// Removes all checkpoints: the run is done.
    pub fn clear(&self) {
        self.checkpoints.clear();
    }

    /// A run that was asked to end, and does so, says which checkpoint there is, where none was taken then.
    pub(in crate::exec) fn tell_of_last(&self, progress: &dyn Progress) {
        if self.is_answered.swap(true, Relaxed) {
            return;
        }
        progress.note(if self.checkpoints.are_there() {
            "nothing could be put by of what ran before the end; --resume goes on from the checkpoint before"
        } else {
            "nothing could be put by of what ran before the end, and there is no checkpoint; the next run begins anew"
        });
    }

    /// Work on a field with which a stage has ended, and which it leaves as it is: where the run is to end in it, a checkpoint of what
    /// that stage left is taken.
    ///
    /// # Errors
    /// Of the work, and when the run is to end.
    pub(in crate::exec) fn after<R>(
        &self,
        stage: &str,
        field: &dyn SavedField,
        by: By<'_>,
        work: impl FnOnce() -> Result<R>,
    ) -> Result<R> {
        let key = format!("{stage} #1");
        let left = self.left.lock().unwrap_or_else(PoisonError::into_inner).remove(&key);
        let Some(Left { facts, stands }) = left else { return work() };
        let mut save_point = self.begin_as(key, false, by);
        save_point.stands = stands;
        save_point.step_packed(|| Ok(facts), &[field], work)
    }

    /// The save point of a stage that begins.
    pub(in crate::exec) fn begin<'a>(&'a self, name: &str, by: By<'a>) -> SavePoint<'a> {
        let mut stages = self.stages.lock().unwrap_or_else(PoisonError::into_inner);
        let count = stages.entry(name.to_owned()).or_default();
        *count += 1;
        self.begin_as(format!("{name} #{count}"), false, by)
    }

    /// That of a stage which is a part of what has one: it goes by the name that [`SavePoint::part`] gives it.
    pub(in crate::exec) fn begin_part<'a>(&'a self, key: &str, by: By<'a>) -> SavePoint<'a> {
        self.begin_as(key.to_owned(), true, by)
    }

    fn begin_as<'a>(&'a self, key: String, is_part: bool, by: By<'a>) -> SavePoint<'a> {
        by.cancel.begin_saving();
        let (wishes, stands) = (self.wishes.load(Relaxed), self.checkpoints.entry(&key).is_some());
        let rank = (by.comm.rank(), by.comm.ranks());
        SavePoint { points: self, by, rank, key, is_part, is_alike: false, stands, last: Instant::now(), wishes }
    }

    /// How often a checkpoint was asked for.
    fn wishes(&self) -> usize {
        let is_new = self.wish.swap(false, Relaxed);
        self.wishes.fetch_add(usize::from(is_new), Relaxed) + usize::from(is_new)
    }

    /// Whether so many more bytes keep checkpoints to their share of the run's time.
    fn affords(&self, more: u64) -> bool {
        let (spent, written) = *self.spent.lock().unwrap_or_else(PoisonError::into_inner);
        let rate = if written > 0 { written as f64 / spent.as_secs_f64().max(1e-6) } else { RATE };
        (spent + Duration::from_secs_f64(more as f64 / rate)) * SHARE <= self.begun.elapsed()
    }

    /// Whether why a checkpoint could not be taken is another reason than the last time.
    fn is_new(&self, failure: io::ErrorKind) -> bool {
        let mut last = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
        last.replace(failure) != Some(failure)
    }

    fn spend(&self, time: Duration, written: u64) {
        let mut spent = self.spent.lock().unwrap_or_else(PoisonError::into_inner);
        *spent = (spent.0 + time, spent.1 + written);
    }
}

/// Whose stage it is: what ends it, who hears of it, and the ranks that work on it.
#[derive(Clone, Copy)]
pub(in crate::exec) struct By<'a> {
    pub(in crate::exec) cancel: &'a Cancel,
    pub(in crate::exec) progress: &'a dyn Progress,
    pub(in crate::exec) comm: &'a dyn Comm,
}

/// What somebody wants at a place where a checkpoint can be taken; of what ranks want the largest counts. What is larger is the end, by
/// the signal of a number smaller by that.
const NOTHING: f64 = 0.0;
const DUE: f64 = 1.0;
const WISHED: f64 = 2.0;

/// Where a stage puts by what it has solved.
pub struct SavePoint<'a> {
    points: &'a SavePoints,
    by: By<'a>,
    /// This rank, of how many.
    rank: (usize, usize),
    key: String,
    /// All ranks have the same fields: the first one puts them by.
    is_alike: bool,
    /// It belongs to another one, which puts by what it ends with.
    is_part: bool,
    /// A checkpoint holds what was there when this was reached last.
    stands: bool,
    last: Instant,
    wishes: usize,
}

impl SavePoint<'_> {
    /// Of a stage whose fields all ranks have alike.
    #[must_use]
    pub fn alike(mut self) -> Self {
        self.is_alike = true;
        self
    }

    /// Of a stage of which each rank puts by what it has done without the others, though all work on it: it is gone on with by the same rank
    /// of as many.
    #[must_use]
    pub fn each(mut self) -> Self {
        self.by.comm = &SelfComm;
        self
    }

    /// Whether one rank works on the stage, and may put by what it has wherever it is.
    #[must_use]
    pub fn is_alone(&self) -> bool {
        self.by.comm.ranks() == 1
    }

    /// What the save point of a part of this is called.
    pub(in crate::exec) fn part(&self, what: &str) -> String {
        format!("{}, {what}", self.key)
    }

    /// A part is over, and what it had put by not needed any more.
    pub fn forget_part(&self, what: &str) {
        self.points.checkpoints.forget(&self.part(what));
    }

    /// What this knows from now on, without any field: it stands in the next checkpoint, whoever takes it.
    ///
    /// # Errors
    /// When it has no form in which it can be put by.
    pub fn know<F: Serialize>(&mut self, facts: &F) -> Result<()> {
        self.stands = false;
        let facts = pack(facts).map_err(|error| Error::from_io("a checkpoint cannot be made", &error))?;
        self.points.checkpoints.know(&self.key, facts);
        Ok(())
    }

    /// A step that is made again by a run that goes on, from `facts` and `fields`, which it leaves as they are and which are those
    /// with which this was reached last: where this run is to end the step ends at once, and a checkpoint of these is taken.
    ///
    /// # Errors
    /// Of the step, and when the run is to end.
    pub fn step<R, F: Serialize>(
        &mut self,
        facts: impl FnOnce() -> F,
        fields: &[&dyn SavedField],
        work: impl FnOnce() -> Result<R>,
    ) -> Result<R> {
        self.step_packed(|| pack(&facts()), fields, work)
    }

    fn step_packed<R>(
        &mut self,
        facts: impl FnOnce() -> io::Result<Vec<u8>>,
        fields: &[&dyn SavedField],
        work: impl FnOnce() -> Result<R>,
    ) -> Result<R> {
        self.by.cancel.go_no_farther();
        let done = work();
        self.by.cancel.go_on();
        let is_ended = |error: &Error| matches!(error.kind(), ErrorKind::Interrupted { .. });
        // Others may be in the midst of theirs, and cannot be asked to come along.
        if self.is_alone() && self.by.cancel.is_saving() && done.as_ref().is_err_and(is_ended) {
            if self.stands {
                self.points.is_answered.store(true, Relaxed);
                self.by.progress.note("the last checkpoint holds what this stage began with; --resume goes on from it");
            } else {
                self.reached_packed(false, || Ok((facts()?, Vec::new())), fields)?;
            }
        }
        done
    }

    /// The stage ends with these facts and one field: what comes after it and works on that field can be put by with them, once the
    /// stage is over (`Engine::after`).
    ///
    /// # Errors
    /// When they have no form in which they can be put by.
    pub fn leave<F: Serialize>(&self, facts: &F) -> Result<()> {
        let facts = pack(facts).map_err(|error| Error::from_io("a checkpoint cannot be made", &error))?;
        let left = Left { facts, stands: self.stands };
        self.points.left.lock().unwrap_or_else(PoisonError::into_inner).insert(self.key.clone(), left);
        Ok(())
    }

    /// What the stage had put by in the run that this one goes on with.
    #[must_use]
    pub fn saved(&self) -> Option<Saved> {
        let kept = self.points.checkpoints.entry(&self.key)?;
        Some(Saved::new(kept, self.rank.0, self.rank.1))
    }

    /// Whether the run is to end with the next checkpoint.
    #[must_use]
    pub fn is_last(&self) -> bool {
        self.by.cancel.is_asked()
    }

    /// What the stage had put by is of no use to it: it begins anew, and says why.
    pub fn forget(&self, why: &str) {
        self.points.checkpoints.forget(&self.key);
        self.note(why);
    }

    /// Tells the user one line about the stage.
    pub fn note(&self, line: &str) {
        let name = self.key.split(" #").next().unwrap_or_default();
        self.by.progress.note(&format!("{name}: {line}"));
    }

    /// What the stage has is consistent: a checkpoint is taken if it is time, and at its end if it is not too dear.
    ///
    /// # Errors
    /// When the run is to end. A checkpoint that cannot be taken is told, and no error.
    pub fn reached<F: Serialize>(
        &mut self,
        ended: bool,
        facts: impl FnOnce() -> F,
        fields: &[&dyn SavedField],
    ) -> Result<()> {
        self.reached_writing(ended, || (facts(), Vec::new()), fields)
    }

    /// The same of a stage that writes the output; `known` tells also which files of that are whole.
    ///
    /// # Errors
    /// As [`SavePoint::reached`].
    pub fn reached_writing<F: Serialize>(
        &mut self,
        ended: bool,
        known: impl FnOnce() -> (F, Vec<Linked>),
        fields: &[&dyn SavedField],
    ) -> Result<()> {
        let known = || {
            let (facts, linked) = known();
            Ok((pack(&facts)?, linked))
        };
        self.reached_packed(ended, known, fields)
    }

    fn reached_packed(
        &mut self,
        ended: bool,
        known: impl FnOnce() -> io::Result<(Vec<u8>, Vec<Linked>)>,
        fields: &[&dyn SavedField],
    ) -> Result<()> {
        let wishes = self.points.wishes();
        let wanted = self.by.comm.agree(self.wanted(ended, wishes, fields), f64::max)?;
        if wanted <= NOTHING {
            self.stands = false;
            return Ok(());
        }
        let (is_wished, is_last) = (wanted >= WISHED, wanted > WISHED);
        if is_last {
            self.by.cancel.ask((wanted - WISHED) as usize);
        }
        self.by.cancel.check()?;
        let started = Instant::now();
        let goes_on = || self.by.cancel.check().map_err(io::Error::other);
        let all = |is_whole: bool| Ok(!self.by.comm.any(!is_whole).map_err(io::Error::other)?);
        let all: Option<&dyn Fn(bool) -> io::Result<bool>> = if self.by.comm.ranks() > 1 { Some(&all) } else { None };
        let fields = if self.is_alike && self.rank.0 > 0 { &[] } else { fields };
        let saved = match known() {
            Ok((facts, linked)) => self.points.checkpoints.save(&self.key, facts, (fields, &linked), &goes_on, all),
            // The others wait for this rank's word.
            Err(error) => all.map_or(Ok(true), |all| all(false)).and(Err(error)),
        };
        let Taken { bytes: written, linking } = *saved.as_ref().unwrap_or(&Taken::default());
        // What is flushed of the output is no cost of checkpoints: it has to reach the disk.
        self.points.spend(started.elapsed().saturating_sub(linking), written);
        (self.last, self.wishes, self.stands) = (Instant::now(), wishes, saved.is_ok());
        let is_second = is_last && self.points.is_answered.swap(true, Relaxed);
        match saved {
            Ok(_) if is_last || is_wished => {
                // What is linked to fields and shards that lie on the disk already takes none.
                let of = if written > 0 { format!(" of {}", bytes(written)) } else { String::new() };
                self.by.progress.note(&format!("a checkpoint{of} was taken; --resume goes on from it"));
            }
            Ok(_) => {}
            Err(error) => {
                let what = match (is_second, is_last) {
                    (true, _) => "no checkpoint could be taken of what was solved before, which is solved again",
                    (_, true) => "no checkpoint could be taken, before the end",
                    _ => "no checkpoint could be taken, the run goes on without",
                };
                let is_late = is_last && self.by.cancel.check().is_err();
                let why =
                    if is_late { "it takes longer than a run that is ended has".into() } else { error.to_string() };
                // One that was asked for is answered each time.
                if self.points.is_new(error.kind()) || is_wished || is_last {
                    self.by.progress.note(&format!("{what}: {why}"));
                }
            }
        }
        self.by.cancel.end()
    }

    /// What is wanted on this rank.
    fn wanted(&self, ended: bool, wishes: usize, fields: &[&dyn SavedField]) -> f64 {
        match self.by.cancel.signal() {
            0 if wishes != self.wishes => WISHED,
            0 if self.is_due(ended, fields) => DUE,
            0 => NOTHING,
            signal => WISHED + signal as f64,
        }
    }

    fn is_due(&self, ended: bool, fields: &[&dyn SavedField]) -> bool {
        let since = self.points.begun.elapsed();
        let ended = ended && !self.is_part;
        if let Some(every) = self.points.every {
            return self.last.elapsed() >= every || (ended && since >= every);
        }
        let is_time = self.last.elapsed() >= EVERY || (ended && since >= SHORT);
        is_time && self.points.affords(fields.iter().map(|field| field.saved_bytes()).sum())
    }
}

impl Drop for SavePoint<'_> {
    fn drop(&mut self) {
        self.by.cancel.end_saving();
    }
}
