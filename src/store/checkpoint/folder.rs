//! The folder of a run's checkpoints: what is written into it, and what a later run finds there.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::identity::{Identity, difference};
use super::links::{LinkOf, Linked, link};
use super::lock::{LOCK, lock, worker};
use super::names::{field_name, manifest_name, names, numbers};
use super::payload::{self, SavedField};
use super::record;
use crate::error::{Error, Result, one_line};
use crate::grid::digits::bytes;
use crate::store::hidden::remove_abandoned;
use crate::store::{HiddenFile, begin_writeback, free_space};

/// So many manifests are kept, with what they name.
const KEPT: usize = 2;
/// Bytes that are handed to the disk at a time.
const BUFFER: usize = 1 << 20;
/// After so many bytes the disk is to begin with them.
const FLOW: usize = 32 << 20;

#[derive(Serialize, Deserialize)]
struct Manifest {
    identity: Identity,
    /// By stage.
    entries: BTreeMap<String, Entry>,
}

impl Manifest {
    /// The files that it names.
    fn files(&self) -> impl Iterator<Item = &FileOf> {
        self.entries.values().flat_map(|entry| &entry.files)
    }

    /// The names of all that it needs.
    fn needed(&self) -> BTreeSet<String> {
        let links = self.entries.values().flat_map(|entry| &entry.links).map(|link| &link.name);
        self.files().map(|file| &file.name).chain(links).cloned().collect()
    }
}

/// What a stage has put by.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Entry {
    /// What it knows, packed.
    facts: Vec<u8>,
    files: Vec<FileOf>,
    links: Vec<LinkOf>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct FileOf {
    name: String,
    bytes: u64,
}

/// What a checkpoint took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Taken {
    /// Bytes of its fields.
    pub bytes: u64,
    /// Time in which files were linked and flushed, which the end of the run would have waited for.
    pub linking: Duration,
}

/// What was found of a stage.
#[derive(Clone, Debug)]
pub struct Kept {
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

/// The checkpoints of a run.
pub struct Checkpoints {
    folder: PathBuf,
    identity: Identity,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    lock: Option<File>,
    /// Whether this run made the folder.
    is_made: bool,
    /// Of the last manifest.
    number: u64,
    entries: BTreeMap<String, Entry>,
    /// Manifests that are kept, and the files that they name.
    kept: BTreeMap<u64, BTreeSet<String>>,
}

impl Checkpoints {
    /// Those of a run that begins. The folder is made when there is something to put into it.
    ///
    /// # Errors
    /// When checkpoints of another run lie there, or one works there.
    pub fn begin(folder: &Path, identity: Identity, replace: bool) -> Result<Self> {
        let there = numbers(folder);
        if !there.is_empty() && !replace {
            return Err(Self::would_be_lost(folder));
        }
        if folder.symlink_metadata().is_ok() && !folder.is_dir() {
            return Err(Error::usage("is no folder; name one for checkpoints").at(folder));
        }
        let state = State { lock: lock(folder)?, ..State::default() };
        let checkpoints = Self { folder: folder.to_path_buf(), identity, state: Mutex::new(state) };
        if !there.is_empty() {
            checkpoints.clear();
        }
        Ok(checkpoints)
    }

    /// Who makes them.
    #[must_use]
    pub fn identity(&self) -> &Identity {
        &self.identity
    }

    /// Whether checkpoints of a run that was ended lie in a folder.
    #[must_use]
    pub fn lie_in(folder: &Path) -> bool {
        !numbers(folder).is_empty()
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
        let mut state = State { lock: lock(folder)?, ..State::default() };
        let mut found = Found::default();
        for number in numbers(folder).into_iter().rev() {
            state.number = state.number.max(number);
            let path = folder.join(manifest_name(number));
            let manifest = match record::read::<Manifest>(&path) {
                Ok(manifest) => manifest,
                Err(error) => {
                    found.torn.push(format!("{}: {error}", path.display()));
                    continue;
                }
            };
            if let Some(difference) = difference(&manifest.identity, &identity) {
                let what = format!(
                    "this run is not the one that was ended: {difference}; give what was given then, or leave --resume out and choose another output"
                );
                return Err(Error::usage(what).at(folder));
            }
            // Of those before the one that is taken nothing is read.
            if state.entries.is_empty()
                && let Some((name, error)) =
                    manifest.files().find_map(|file| Some((&file.name, whole(folder, file).err()?)))
            {
                found.torn.push(format!("{}: {error}", folder.join(name).display()));
                continue;
            }
            state.kept.insert(number, manifest.needed());
            if state.entries.is_empty() {
                found.stages = manifest.entries.len();
                state.entries = manifest.entries;
            }
        }
        Ok((Self { folder: folder.to_path_buf(), identity, state: Mutex::new(state) }, found))
    }

    /// What a stage has put by.
    #[must_use]
    pub fn entry(&self, key: &str) -> Option<Kept> {
        let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let entry = state.entries.get(key)?;
        let files = entry.files.iter().map(|file| self.folder.join(&file.name)).collect();
        let links = entry.links.iter().map(|link| self.folder.join(&link.name)).collect();
        Some(Kept { facts: entry.facts.clone(), files, links })
    }

    /// Whether there is one, of this run or of the one that it goes on with.
    #[must_use]
    pub fn are_there(&self) -> bool {
        !self.state.lock().unwrap_or_else(PoisonError::into_inner).kept.is_empty()
    }

    /// What a stage has put by is of no use: the next checkpoint names nothing of it.
    pub fn forget(&self, key: &str) {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).entries.remove(key);
    }

    /// What a stage knows now, without files: the next checkpoint tells it.
    pub fn know(&self, key: &str, facts: Vec<u8>) {
        let entry = Entry { facts, files: Vec::new(), links: Vec::new() };
        self.state.lock().unwrap_or_else(PoisonError::into_inner).entries.insert(key.to_owned(), entry);
    }

    /// Puts by what a stage knows, in place of what it did before. `goes_on` is asked between bricks, and between files that are
    /// linked.
    ///
    /// # Errors
    /// When it cannot be written, or is not to go on: then the checkpoint before stands.
    pub fn save(
        &self,
        key: &str,
        facts: Vec<u8>,
        (fields, linked): (&[&dyn SavedField], &[Linked]),
        goes_on: &dyn Fn() -> io::Result<()>,
    ) -> io::Result<Taken> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        self.open(&mut state)?;
        let needed = fields.iter().map(|field| field.saved_bytes()).sum();
        self.make_room(&mut state, needed)?;
        let taken = self.take(&mut state, key, facts, (fields, linked), goes_on);
        if taken.is_err() {
            // What there is of one that is not whole takes room that the run may need.
            self.drop_older(&mut state);
        }
        taken.map_err(|error| self.explained(error, needed))
    }

    /// Writes a checkpoint.
    fn take(
        &self,
        state: &mut State,
        key: &str,
        facts: Vec<u8>,
        (fields, linked): (&[&dyn SavedField], &[Linked]),
        goes_on: &dyn Fn() -> io::Result<()>,
    ) -> io::Result<Taken> {
        let number = state.number + 1;
        // What a number that was not finished has left must not stand in the way of the next.
        state.number = number;
        let started = Instant::now();
        let before = state.entries.get(key).map(|entry| entry.links.as_slice()).unwrap_or_default();
        let links = link(&self.folder, number, before, linked, goes_on)?;
        let linking = started.elapsed();
        let mut files = Vec::new();
        for (n, field) in fields.iter().enumerate() {
            let name = field_name(number, n);
            self.put(&name, &mut |out| field.save(out, goes_on))?;
            files.push(FileOf { name, bytes: field.saved_bytes() });
        }
        let bytes = files.iter().map(|file| file.bytes).sum();
        let mut entries = state.entries.clone();
        entries.insert(key.to_owned(), Entry { facts, files, links });
        let manifest = Manifest { identity: self.identity.clone(), entries };
        self.put(&manifest_name(number), &mut |out| record::write(&mut &mut *out, &manifest))?;
        // A name is safe when its folder is.
        File::open(&self.folder).and_then(|folder| folder.sync_all())?;
        state.kept.insert(number, manifest.needed());
        state.entries = manifest.entries;
        self.drop_older(state);
        Ok(Taken { bytes, linking })
    }

    /// Sees to it that a checkpoint may fit: of those before the last one alone stays, where there is too little room for both. The
    /// disk may be that of the output, which is not to fail because of a checkpoint.
    fn make_room(&self, state: &mut State, needed: u64) -> io::Result<()> {
        let has_room = || free_space(&self.folder).is_none_or(|free| free > needed);
        if !has_room() && state.kept.len() > 1 {
            while state.kept.len() > 1 {
                state.kept.pop_first();
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
            state.lock = lock(&self.folder).map_err(io::Error::other)?;
            if !numbers(&self.folder).is_empty() {
                state.lock = None;
                return Err(io::Error::other("another run has put checkpoints into the same folder meanwhile"));
            }
        }
        // What somebody has removed is not named again.
        let is_there = |name: &str| self.folder.join(name).exists();
        state.entries.retain(|_, entry| {
            entry.files.iter().all(|file| is_there(&file.name)) && entry.links.iter().all(|link| is_there(&link.name))
        });
        Ok(())
    }

    /// Writes a file beside, flushes it, and gives it its name.
    fn put(&self, name: &str, write: &mut dyn FnMut(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
        let (hidden, file) = HiddenFile::create(&self.folder.join(name), "")?;
        let mut out = BufWriter::with_capacity(BUFFER, Flowing { file, waiting: 0 });
        write(&mut out)?;
        out.into_inner().map_err(io::IntoInnerError::into_error)?;
        hidden.sync()?;
        hidden.place(true)
    }

    /// Removes what no manifest names that is kept.
    fn drop_older(&self, state: &mut State) {
        while state.kept.len() > KEPT {
            state.kept.pop_first();
        }
        let is_kept = |name: &str| {
            let is_manifest = state.kept.keys().any(|&number| name == manifest_name(number));
            is_manifest || state.kept.values().any(|files| files.contains(name))
        };
        for name in names(&self.folder).into_iter().filter(|name| !is_kept(name)) {
            // What cannot be removed takes room and is in nobody's way.
            let _ = fs::remove_file(self.folder.join(name));
        }
    }

    /// Removes all of them, for a run that is done, and the folder where nothing else lies in it.
    pub fn clear(&self) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        (state.entries, state.kept) = (BTreeMap::new(), BTreeMap::new());
        // What lies there without this run's lock is another one's.
        if state.lock.is_none() {
            return;
        }
        self.drop_older(&mut state);
        remove_abandoned(&self.folder);
        let _ = fs::remove_file(self.folder.join(LOCK));
        if state.is_made || self.folder.extension().is_some_and(|ending| ending == "checkpoint") {
            let _ = fs::remove_dir(&self.folder);
        }
        state.lock = None;
    }
}

/// A file of which the disk gets what was written while the rest still is: it is waited for in the end.
struct Flowing {
    file: File,
    waiting: usize,
}

impl Write for Flowing {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.file.write(bytes)?;
        self.waiting += written;
        if self.waiting >= FLOW {
            begin_writeback(&self.file);
            self.waiting = 0;
        }
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// Checks a file of bricks from its beginning to its end.
fn whole(folder: &Path, file: &FileOf) -> io::Result<()> {
    let opened = File::open(folder.join(&file.name))?;
    if opened.metadata()?.len() != file.bytes {
        return Err(io::Error::new(io::ErrorKind::InvalidData, "has not the length that it had"));
    }
    payload::check(&mut BufReader::with_capacity(BUFFER, opened), file.bytes)
}

#[cfg(test)]
mod tests;
