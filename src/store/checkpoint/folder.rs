//! The folder of a run's checkpoints: what is written into it, and what a later run finds there.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use serde::{Deserialize, Serialize};

use super::identity::{Identity, difference};
use super::lock::{LOCK, lock, worker};
use super::payload::{self, SavedField};
use super::record;
use crate::error::{Error, Result};
use crate::store::HiddenFile;
use crate::store::hidden::remove_abandoned;

/// The names of manifests and fields end like this.
const ENDINGS: [&str; 2] = [".checkpoint", ".bricks"];
/// So many manifests are kept, with what they name.
const KEPT: usize = 2;
/// Bytes that are handed to the disk at a time.
const BUFFER: usize = 1 << 20;

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
}

/// What a stage has put by.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Entry {
    /// What it knows, packed.
    facts: Vec<u8>,
    files: Vec<FileOf>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
struct FileOf {
    name: String,
    bytes: u64,
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
            state.kept.insert(number, manifest.files().map(|file| file.name.clone()).collect());
            if state.entries.is_empty() {
                found.stages = manifest.entries.len();
                state.entries = manifest.entries;
            }
        }
        Ok((Self { folder: folder.to_path_buf(), identity, state: Mutex::new(state) }, found))
    }

    /// What a stage has put by, and the files of its fields.
    #[must_use]
    pub fn entry(&self, key: &str) -> Option<(Vec<u8>, Vec<PathBuf>)> {
        let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let entry = state.entries.get(key)?;
        Some((entry.facts.clone(), entry.files.iter().map(|file| self.folder.join(&file.name)).collect()))
    }

    /// Puts by what a stage knows, in place of what it did before. `goes_on` is asked between bricks. Returns the bytes of its
    /// fields.
    ///
    /// # Errors
    /// When it cannot be written, or is not to go on: then the checkpoint before stands.
    pub fn save(
        &self,
        key: &str,
        facts: Vec<u8>,
        fields: &[&dyn SavedField],
        goes_on: &dyn Fn() -> io::Result<()>,
    ) -> io::Result<u64> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if state.lock.is_none() {
            state.is_made = !self.folder.is_dir();
            fs::create_dir_all(&self.folder)?;
            state.lock = lock(&self.folder).map_err(io::Error::other)?;
            if !numbers(&self.folder).is_empty() {
                state.lock = None;
                return Err(io::Error::other("another run has put checkpoints into the same folder meanwhile"));
            }
        }
        let number = state.number + 1;
        // What a number that was not finished has left must not stand in the way of the next.
        state.number = number;
        let mut files = Vec::new();
        for (n, field) in fields.iter().enumerate() {
            let name = format!("{number:06}-{n}{}", ENDINGS[1]);
            self.put(&name, &mut |out| field.save(out, goes_on))?;
            files.push(FileOf { name, bytes: field.saved_bytes() });
        }
        let bytes = files.iter().map(|file| file.bytes).sum();
        let mut entries = state.entries.clone();
        entries.insert(key.to_owned(), Entry { facts, files });
        let manifest = Manifest { identity: self.identity.clone(), entries };
        self.put(&manifest_name(number), &mut |out| record::write(&mut &mut *out, &manifest))?;
        // A name is safe when its folder is.
        File::open(&self.folder).and_then(|folder| folder.sync_all())?;
        state.kept.insert(number, manifest.files().map(|file| file.name.clone()).collect());
        state.entries = manifest.entries;
        self.drop_older(&mut state);
        Ok(bytes)
    }

    /// Writes a file beside, flushes it, and gives it its name.
    fn put(&self, name: &str, write: &mut dyn FnMut(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
        let (hidden, file) = HiddenFile::create(&self.folder.join(name), "")?;
        let mut out = BufWriter::with_capacity(BUFFER, file);
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

fn manifest_name(number: u64) -> String {
    format!("{number:06}{}", ENDINGS[0])
}

/// The numbers of the manifests in a folder, ascending.
fn numbers(folder: &Path) -> Vec<u64> {
    let names = names(folder);
    let mut numbers: Vec<u64> = names.iter().filter_map(|name| name.strip_suffix(ENDINGS[0])?.parse().ok()).collect();
    numbers.sort_unstable();
    numbers
}

/// The names in a folder that are those of checkpoints.
fn names(folder: &Path) -> Vec<String> {
    let is_number = |digits: &str| !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    let is_ours = |name: &String| {
        let of_field = name.strip_suffix(ENDINGS[1]).and_then(|stem| stem.split_once('-'));
        let is_field = of_field.is_some_and(|(number, n)| number.len() >= 6 && is_number(number) && is_number(n));
        is_field || name.strip_suffix(ENDINGS[0]).is_some_and(|number| number.len() >= 6 && is_number(number))
    };
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let files = entries.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_file()));
    files.filter_map(|entry| entry.file_name().into_string().ok()).filter(is_ours).collect()
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
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::grid::{BrickGrid, BrickSet};
    use crate::store::{BrickArray, Scratch};

    fn identity(spacing: &str) -> Identity {
        vec![("version".into(), "1".into()), ("--spacing".into(), spacing.into())]
    }

    fn field(scratch: &Scratch, value: f32) -> BrickArray<f32> {
        let set = Arc::new(BrickSet::dense(BrickGrid::new([32, 32, 16], 16)));
        let field = BrickArray::new(scratch, &set).unwrap();
        set.owned().for_each(|slot| field.write(slot, |brick| brick.fill(value)));
        field
    }

    /// Three checkpoints of one stage and one of another, in a folder that is let go.
    fn made(folder: &Path, scratch: &Scratch) {
        let run = Checkpoints::begin(folder, identity("2"), false).unwrap();
        for step in 1..=3_u8 {
            run.save("moving", vec![step], &[&field(scratch, f32::from(step))], &|| Ok(())).unwrap();
        }
        run.save("other", vec![9], &[], &|| Ok(())).unwrap();
        let failing = run.save("moving", vec![4], &[&field(scratch, 4.0)], &|| Err(io::Error::other("not now")));
        assert_eq!(failing.unwrap_err().to_string(), "not now");
    }

    #[test]
    fn a_run_goes_on_from_the_last_whole_checkpoint() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("c.checkpoint");
        let scratch = Scratch::new(dir.path(), 1 << 30);
        made(&folder, &scratch);
        assert_eq!(numbers(&folder), [3, 4]);
        let facts = |run: &Checkpoints| run.entry("moving").map(|(facts, files)| (facts, files.len()));
        let (run, found) = Checkpoints::resume(&folder, identity("2")).unwrap();
        assert_eq!((found.stages, found.torn.len(), facts(&run)), (2, 0, Some((vec![3], 1))));
        let busy = [Checkpoints::resume(&folder, identity("2")).err().unwrap(), Checkpoints::would_be_lost(&folder)];
        let is_told = |error: Error| error.to_string().contains("belongs to a run that goes on (host");
        assert!(busy.into_iter().all(is_told));
        drop(run);
        let file = folder.join("000004.checkpoint");
        let whole = fs::read(&file).unwrap();
        fs::write(&file, &whole[..whole.len() - 1]).unwrap();
        let (run, found) = Checkpoints::resume(&folder, identity("2")).unwrap();
        assert_eq!((found.stages, found.torn.len(), facts(&run)), (1, 1, Some((vec![3], 1))));
        run.save("moving", vec![5], &[&field(&scratch, 5.0)], &|| Ok(())).unwrap();
        assert_eq!(numbers(&folder), [3, 5], "a number is never used again, and the torn one is gone");
        run.clear();
        assert!(!folder.exists());
    }

    #[test]
    fn a_damaged_field_leaves_nothing_to_go_on_with_where_both_checkpoints_name_it() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("c");
        let scratch = Scratch::new(dir.path(), 1 << 30);
        made(&folder, &scratch);
        let file = folder.join("000003-0.bricks");
        let mut bytes = fs::read(&file).unwrap();
        bytes[5000] ^= 4;
        fs::write(&file, bytes).unwrap();
        let (run, found) = Checkpoints::resume(&folder, identity("2")).unwrap();
        assert_eq!((found.stages, found.torn.len()), (0, 2));
        assert!(found.torn[0].contains("the checksum of a brick does not fit"), "{:?}", found.torn);
        assert!(run.entry("moving").is_none() && run.entry("other").is_none());
    }

    #[test]
    fn other_runs_are_refused_and_nothing_is_lost_without_leave() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("c");
        made(&folder, &Scratch::new(dir.path(), 1 << 30));
        let error = Checkpoints::resume(&folder, identity("3")).err().unwrap().to_string();
        assert!(error.contains("--spacing was 2 and is 3"), "{error}");
        let error = Checkpoints::begin(&folder, identity("2"), false).err().unwrap().to_string();
        assert!(error.contains("give --resume to go on with it"), "{error}");
        let (_, found) = Checkpoints::resume(&dir.path().join("nowhere"), identity("2")).unwrap();
        assert_eq!(found, Found::default());
        let mine = ["mine.txt", "2024-11-05.bricks", "lock"];
        for name in mine {
            fs::write(folder.join(name), "x").unwrap();
        }
        drop(Checkpoints::begin(&folder, identity("3"), true).unwrap());
        assert!(numbers(&folder).is_empty() && mine.iter().all(|name| folder.join(name).exists()));
    }

    #[test]
    fn runs_that_began_in_one_folder_leave_each_others_checkpoints() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("c");
        let [first, second] = ["2", "3"].map(|spacing| Checkpoints::begin(&folder, identity(spacing), false).unwrap());
        first.save("moving", vec![1], &[], &|| Ok(())).unwrap();
        let refused = second.save("moving", vec![2], &[], &|| Ok(())).unwrap_err().to_string();
        assert!(refused.contains("belongs to a run that goes on"), "{refused}");
        second.clear();
        assert_eq!(numbers(&folder), [1]);
        drop(first);
        let refused = second.save("moving", vec![2], &[], &|| Ok(())).unwrap_err().to_string();
        assert!(refused.contains("another run has put checkpoints"), "{refused}");
        second.clear();
        assert_eq!(numbers(&folder), [1]);
    }
}
