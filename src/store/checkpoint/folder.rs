//! The folder of a run's checkpoints: what is written into it, and what a later run finds there.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::identity::Identity;
use super::last_whole::{Chosen, last_whole, read_chosen};
use super::links::{Linked, link};
use super::lock::{LOCK, lock, worker};
use super::manifest::{Entry, FileOf, Held, Manifest};
use super::names::{Owner, field_name, manifest_name, manifests, names, number_and_owner};
use super::payload::SavedField;
use super::put::put;
use super::record;
use crate::error::{Error, Result, one_line};
use crate::grid::digits::bytes;
use crate::store::free_space;
use crate::store::hidden::remove_abandoned;

/// So many manifests are kept, with what they name.
const KEPT: usize = 2;

/// What a checkpoint took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Taken {
    /// Bytes of its fields.
    pub bytes: u64,
    /// Time in which files were linked and flushed, which the end of the run would have waited for.
    pub linking: Duration,
}

/// What was found of a stage: of each rank that had put by something, in their order.
#[derive(Clone, Debug)]
pub struct Kept {
    /// One at least.
    pub parts: Vec<KeptPart>,
}

/// What a rank had put by of a stage.
#[derive(Clone, Debug)]
pub struct KeptPart {
    /// The rank, of how many.
    pub rank: usize,
    /// See there.
    pub ranks: usize,
    /// What it knew, packed.
    pub facts: Vec<u8>,
    /// The files of its fields.
    pub files: Vec<PathBuf>,
    /// The second names of files of the output, in the order in which the stage gave them. Nobody has looked at what they hold.
    pub links: Vec<PathBuf>,
}

/// What was found in a folder by a run that is to go on.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// Number of stages that can be gone on with.
    pub stages: usize,
    /// What was passed over, and why.
    pub torn: Vec<String>,
}

/// The checkpoints of a run, or of one of its ranks.
pub struct Checkpoints {
    folder: PathBuf,
    identity: Identity,
    /// The rank that they are of, of how many.
    rank: usize,
    ranks: usize,
    /// What has numbers up to this one was there when the run began.
    since: u64,
    state: Mutex<State>,
}

/// What the first rank tells the others of the checkpoints in a folder.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Shared {
    folder: PathBuf,
    identity: Identity,
    since: u64,
    manifests: Vec<String>,
}

#[derive(Default)]
struct State {
    lock: Option<File>,
    /// Whether this run made the folder.
    is_made: bool,
    /// Of the last manifest.
    number: u64,
    /// How many were taken by all ranks together.
    together: u64,
    entries: BTreeMap<String, Held>,
    /// Manifests that are kept, with the names of what they need.
    kept: BTreeMap<u64, BTreeSet<String>>,
    /// What the run went on from: the names of its manifests, and of all that these need.
    manifests: Vec<String>,
    inherited: BTreeSet<String>,
}

impl State {
    fn of(chosen: Chosen, lock: Option<File>) -> Self {
        let Chosen { last: number, manifests, needed: inherited, entries, .. } = chosen;
        Self { lock, number, entries, manifests, inherited, ..Self::default() }
    }
}

impl Checkpoints {
    fn new(folder: &Path, identity: Identity, (rank, ranks): (usize, usize), state: State) -> Self {
        let since = state.number;
        Self { folder: folder.to_path_buf(), identity, rank, ranks, since, state: Mutex::new(state) }
    }

    /// Those of a run that begins. The folder is made when there is something to put into it.
    ///
    /// # Errors
    /// When checkpoints of another run lie there, or one works there.
    pub fn begin(folder: &Path, identity: Identity, replace: bool) -> Result<Self> {
        let are_there = Self::lie_in(folder);
        if are_there && !replace {
            return Err(Self::would_be_lost(folder));
        }
        if folder.symlink_metadata().is_ok() && !folder.is_dir() {
            return Err(Error::usage("is no folder; name one for checkpoints").at(folder));
        }
        let state = State { lock: lock(folder)?, ..State::default() };
        let checkpoints = Self::new(folder, identity, (0, 1), state);
        if are_there {
            checkpoints.clear();
        }
        Ok(checkpoints)
    }

    /// The same on the first of several ranks, which makes the folder and works there for all, and what it tells the others.
    ///
    /// # Errors
    /// When the folder cannot be made.
    pub fn of_first(self, ranks: usize) -> Result<(Self, Shared)> {
        let first = Self { ranks, ..self };
        let mut state = first.state.lock().unwrap_or_else(PoisonError::into_inner);
        let made = first.open(&mut state);
        // The number of a checkpoint tells whose it is: nobody's may be below it. Nothing else has to stay.
        first.remove(|name| !state.inherited.contains(name));
        let manifests = std::mem::take(&mut state.manifests);
        drop(state);
        made.map_err(|error| Error::from_io("no checkpoint can be put there", &error).at(&first.folder))?;
        let shared =
            Shared { folder: first.folder.clone(), identity: first.identity.clone(), since: first.since, manifests };
        Ok((first, shared))
    }

    /// Those of another rank than the first.
    ///
    /// # Errors
    /// When what the first one found cannot be read here.
    pub fn of_rank(shared: Shared, rank: usize, ranks: usize) -> Result<Self> {
        let Shared { folder, identity, since, manifests } = shared;
        let chosen = Chosen { last: since, ..read_chosen(&folder, &manifests)? };
        Ok(Self::new(&folder, identity, (rank, ranks), State::of(chosen, None)))
    }

    fn owner(&self) -> Owner {
        Owner::new(self.rank, self.ranks)
    }

    /// Who makes them.
    #[must_use]
    pub fn identity(&self) -> &Identity {
        &self.identity
    }

    /// Whether checkpoints of a run that was ended lie in a folder.
    #[must_use]
    pub fn lie_in(folder: &Path) -> bool {
        !manifests(folder).is_empty()
    }

    /// What is said where they would go without leave.
    #[must_use]
    pub fn would_be_lost(folder: &Path) -> Error {
        let what =
            "holds checkpoints of a run that was ended; give --resume to go on with it, or --overwrite to begin anew";
        worker(folder).unwrap_or_else(|| Error::usage(what).at(folder))
    }

    /// Those of a run that goes on with what was put by in a folder: the last checkpoint that is whole.
    ///
    /// # Errors
    /// When they are of other settings, inputs or another version, which are named, or a run works there.
    pub fn resume(folder: &Path, identity: Identity) -> Result<(Self, Found)> {
        let lock = lock(folder)?;
        let mut chosen = last_whole(folder, &identity)?;
        let found = Found { stages: chosen.entries.len(), torn: std::mem::take(&mut chosen.torn) };
        Ok((Self::new(folder, identity, (0, 1), State::of(chosen, lock)), found))
    }

    /// What a stage has put by.
    #[must_use]
    pub fn entry(&self, key: &str) -> Option<Kept> {
        let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let part = |entry: &Entry| KeptPart {
            rank: entry.rank,
            ranks: entry.ranks,
            facts: entry.facts.clone(),
            files: entry.files.iter().map(|file| self.folder.join(&file.name)).collect(),
            links: entry.links.iter().map(|link| self.folder.join(&link.name)).collect(),
        };
        Some(Kept { parts: state.entries.get(key)?.parts.iter().map(part).collect() })
    }

    /// Whether there is one, of this run or of the one that it goes on with.
    #[must_use]
    pub fn are_there(&self) -> bool {
        let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        !state.kept.is_empty() || !state.inherited.is_empty()
    }

    /// What a stage has put by is of no use: the next checkpoint names nothing of it.
    pub fn forget(&self, key: &str) {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).entries.remove(key);
    }

    /// What a stage knows now, without files: the next checkpoint tells it.
    pub fn know(&self, key: &str, facts: Vec<u8>) {
        let held = Held::own(self.made(facts));
        self.state.lock().unwrap_or_else(PoisonError::into_inner).entries.insert(key.to_owned(), held);
    }

    /// What this rank knows of a stage, without files.
    fn made(&self, facts: Vec<u8>) -> Entry {
        Entry { rank: self.rank, ranks: self.ranks, facts, files: Vec::new(), links: Vec::new() }
    }

    /// Puts by what a stage knows, in place of what it did before. `goes_on` is asked between bricks, and between files that are
    /// linked. Where all ranks do at the same time, `all` tells whether each could.
    ///
    /// # Errors
    /// When it cannot be written, or is not to go on, here or on another of these ranks: then the checkpoint before stands.
    pub fn save(
        &self,
        key: &str,
        facts: Vec<u8>,
        of: (&[&dyn SavedField], &[Linked]),
        goes_on: &dyn Fn() -> io::Result<()>,
        all: Option<&dyn Fn(bool) -> io::Result<bool>>,
    ) -> io::Result<Taken> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let needed = of.0.iter().map(|field| field.saved_bytes()).sum();
        let opened = self.open(&mut state).and_then(|()| self.make_room(&mut state, needed));
        let taken = opened.and_then(|()| self.take(&mut state, key, facts, of, goes_on, all.is_some()));
        let is_whole = all.map_or(Ok(taken.is_ok()), |all| all(taken.is_ok()));
        let adopted = match (taken, is_whole) {
            (Ok((taken, manifest)), Ok(true)) => {
                let mut needed = manifest.needed();
                needed.insert(manifest_name(self.owner(), state.number));
                let number = state.number;
                state.kept.insert(number, needed);
                (state.entries, state.together) = (manifest.entries, manifest.together);
                Ok(taken)
            }
            (Err(error), _) | (_, Err(error)) => Err(self.explained(error, needed)),
            (Ok(_), Ok(false)) => Err(io::Error::other("another rank could not put by its part")),
        };
        // Also of one that is not whole: what there is of it takes room that the run may need. What lies there without this run's lock is
        // another one's.
        if self.rank > 0 || state.lock.is_some() {
            self.drop_older(&mut state);
        }
        adopted
    }

    /// Writes a checkpoint.
    fn take(
        &self,
        state: &mut State,
        key: &str,
        facts: Vec<u8>,
        (fields, linked): (&[&dyn SavedField], &[Linked]),
        goes_on: &dyn Fn() -> io::Result<()>,
        is_together: bool,
    ) -> io::Result<(Taken, Manifest)> {
        let (owner, number) = (self.owner(), state.number + 1);
        // What a number that was not finished has left must not stand in the way of the next.
        state.number = number;
        let started = Instant::now();
        let is_own = |part: &&Entry| (part.rank, part.ranks) == (self.rank, self.ranks);
        let own = state.entries.get(key).and_then(|held| held.parts.iter().find(is_own));
        let before = own.map(|part| part.links.as_slice()).unwrap_or_default();
        let links = link(&self.folder, (owner, number), before, linked, goes_on)?;
        let linking = started.elapsed();
        let mut files = Vec::new();
        for (n, field) in fields.iter().enumerate() {
            let name = field_name(owner, number, n);
            put(&self.folder.join(&name), &mut |out| field.save(out, goes_on))?;
            files.push(FileOf { name, bytes: field.saved_bytes() });
        }
        let bytes = files.iter().map(|file| file.bytes).sum();
        let mut entries = state.entries.clone();
        entries.insert(key.to_owned(), Held::own(Entry { files, links, ..self.made(facts) }));
        let manifest = Manifest {
            identity: self.identity.clone(),
            rank: self.rank,
            ranks: self.ranks,
            since: self.since,
            together: state.together + u64::from(is_together),
            entries,
        };
        let name = manifest_name(owner, number);
        put(&self.folder.join(name), &mut |out| record::write(&mut &mut *out, &manifest))?;
        // A name is safe when its folder is.
        File::open(&self.folder).and_then(|folder| folder.sync_all())?;
        Ok((Taken { bytes, linking }, manifest))
    }

    /// Sees to it that a checkpoint may fit: of those before the last one alone stays, where there is too little room for both. The
    /// disk may be that of the output, which is not to fail because of a checkpoint.
    fn make_room(&self, state: &mut State, needed: u64) -> io::Result<()> {
        let has_room = || free_space(&self.folder).is_none_or(|free| free > needed);
        if !has_room() && !state.kept.is_empty() {
            while state.kept.len() > 1 {
                state.kept.pop_first();
            }
            if self.ranks == 1 {
                state.inherited.clear();
            }
            self.drop_older(state);
        }
        if has_room() { Ok(()) } else { Err(self.explained(io::ErrorKind::StorageFull.into(), needed)) }
    }

    /// What the user has to know of a failure: where it was, and of a full disk how much is needed.
    fn explained(&self, error: io::Error, needed: u64) -> io::Error {
        let folder = one_line(self.folder.display().to_string());
        if !matches!(error.kind(), io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded) {
            // What did not come from the system tells all there is to tell.
            let is_told = error.raw_os_error().is_none();
            return if is_told { error } else { io::Error::new(error.kind(), format!("{folder}: {error}")) };
        }
        let free = free_space(&self.folder).map_or(String::new(), |free| format!(", and has {}", bytes(free)));
        let what = format!("{folder}: the disk is full: a checkpoint needs {}{free}; make room there", bytes(needed));
        io::Error::new(io::ErrorKind::StorageFull, what)
    }

    /// Makes the folder where this run has not taken a checkpoint yet, or somebody has removed it, and locks it.
    fn open(&self, state: &mut State) -> io::Result<()> {
        if state.lock.is_some() && !self.folder.is_dir() {
            (state.lock, state.kept) = (None, BTreeMap::new());
        }
        if state.lock.is_none() {
            state.is_made = !self.folder.is_dir();
            let failed = |error: io::Error| {
                io::Error::new(error.kind(), format!("{}: cannot be made: {error}", self.folder.display()))
            };
            fs::create_dir_all(&self.folder).map_err(failed)?;
            // The first rank works there for all.
            state.lock = if self.rank == 0 { lock(&self.folder).map_err(io::Error::other)? } else { None };
            if self.ranks == 1 && Self::lie_in(&self.folder) {
                state.lock = None;
                return Err(io::Error::other("another run has put checkpoints into the same folder meanwhile"));
            }
        }
        // What somebody has removed is not named again.
        let is_there = |name: &str| self.folder.join(name).exists();
        state.entries.retain(|_, held| held.parts.iter().flat_map(Entry::names).all(|name| is_there(name)));
        Ok(())
    }

    /// Removes what no manifest names that is kept. A rank of several has made what bears its name in this run; of what was there before
    /// others may go on.
    fn drop_older(&self, state: &mut State) {
        while state.kept.len() > KEPT {
            state.kept.pop_first();
        }
        if self.ranks == 1 && state.kept.len() == KEPT {
            state.inherited.clear();
        }
        let is_own = |name: &str| {
            self.ranks == 1 || number_and_owner(name).is_some_and(|(n, of)| n > self.since && of == self.owner())
        };
        let is_kept =
            |name: &str| state.inherited.contains(name) || state.kept.values().any(|needed| needed.contains(name));
        self.remove(|name| is_own(name) && !is_kept(name));
    }

    /// Removes files of checkpoints. What cannot be removed takes room and is in nobody's way.
    fn remove(&self, is_to_go: impl Fn(&str) -> bool) {
        for name in names(&self.folder).into_iter().filter(|name| is_to_go(name)) {
            let _ = fs::remove_file(self.folder.join(name));
        }
    }

    /// Removes all of them, for a run that is done, and the folder where nothing else lies in it. Of several ranks the first does.
    pub fn clear(&self) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        (state.entries, state.kept, state.inherited) = (BTreeMap::new(), BTreeMap::new(), BTreeSet::new());
        // What lies there without this run's lock is another one's.
        if state.lock.is_none() {
            return;
        }
        self.remove(|_| true);
        remove_abandoned(&self.folder);
        let _ = fs::remove_file(self.folder.join(LOCK));
        if state.is_made || self.folder.extension().is_some_and(|ending| ending == "checkpoint") {
            let _ = fs::remove_dir(&self.folder);
        }
        state.lock = None;
    }
}

#[cfg(test)]
mod tests;
