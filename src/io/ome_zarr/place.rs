//! Where a store stands while it is made: under a hidden name beside its final one until it is whole, or, a live one, under its
//! own name from the start; or where another process of the same run has begun it.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use tempfile::TempDir;

use super::abandoned::{self, REPLACED};
use super::files::{io_error, sync_tree};
use super::root::{LiveState, Root, live};
use crate::error::{Error, Result};
use crate::store::Unfinished;

/// The folder of a live store in which surfaces lie that still move; gone at the end.
pub const GROWING: &str = "growing";

/// A place for a store.
#[derive(Debug)]
pub(super) enum Place {
    /// Dropped before it is finished it goes.
    Hidden(Hidden),
    /// Dropped before it is finished it stays, and says so; without a shard in it it goes.
    Live(Standing),
    /// Another process has begun it, and finishes it; this one adds shards.
    Joined(Joined),
}

/// A folder that another process of the run looks after.
#[derive(Debug)]
pub(super) struct Joined {
    pub(super) folder: PathBuf,
    /// Whether it stands under its own name already.
    pub(super) is_live: bool,
}

/// A folder under a hidden name.
#[derive(Debug)]
pub(super) struct Hidden {
    partial: TempDir,
    /// Says so to whoever ends the process.
    unfinished: Unfinished,
    /// Says to other runs that somebody works in the folder.
    _claim: Option<File>,
}

/// A folder under its own name.
#[derive(Debug)]
pub(super) struct Standing {
    path: PathBuf,
    root: Arc<Root>,
    finished: bool,
    /// What was there before, which goes with this, or comes back where this never got a shard.
    replaced: Option<Replaced>,
    _claim: Option<File>,
    _unfinished: Unfinished,
}

/// A store under a hidden name that tells it from one in the making: where the run is killed, the next one puts it back.
#[derive(Debug)]
struct Replaced {
    folder: PathBuf,
    goes: bool,
    _claim: Option<File>,
}

impl Replaced {
    /// Sets a store aside.
    fn new(path: &Path) -> std::io::Result<Self> {
        let free = hidden_folder(path).map_err(std::io::Error::other)?;
        let mut folder = free.path().as_os_str().to_owned();
        folder.push(REPLACED);
        let folder = PathBuf::from(folder);
        // Locked before it is there for others to find.
        let claim = abandoned::claim(path);
        fs::rename(path, &folder)?;
        Ok(Self { folder, goes: true, _claim: claim })
    }

    /// Puts it where it was.
    fn put_back(mut self, path: &Path) {
        self.goes = false;
        // Where that fails it stays under its hidden name.
        let _ = fs::rename(&self.folder, path);
    }
}

impl Drop for Replaced {
    fn drop(&mut self) {
        if self.goes {
            // What cannot be removed is in nobody's way.
            let _ = fs::remove_dir_all(&self.folder);
        }
    }
}

impl Place {
    /// A hidden place for the store that is to lie at `path`. What killed runs left in the making of the same store goes.
    pub(super) fn hidden(path: &Path) -> Result<Self> {
        let partial = hidden_folder(path)?;
        // Locked before anything is in it: see `abandoned`.
        let claim = abandoned::claim(partial.path());
        let unfinished = Unfinished::new(partial.path());
        Ok(Self::Hidden(Hidden { partial, unfinished, _claim: claim }))
    }

    /// The place itself; a store that is there makes room.
    pub(super) fn live(path: &Path, root: Arc<Root>) -> Result<Self> {
        let fault = |error: std::io::Error| io_error("the output cannot be created in its folder", &error).at(path);
        // What killed runs left goes, also where nothing makes room.
        drop(hidden_folder(path)?);
        let replaced = exists(path).then(|| Replaced::new(path)).transpose().map_err(fault)?;
        fs::create_dir(path).map_err(fault)?;
        root.stay();
        let claim = abandoned::claim(path);
        let at_the_end = root.clone();
        let unfinished = Unfinished::settled_by(path, move || at_the_end.interrupt());
        root.tell(LiveState::Running, 0.0).map_err(|error| error.at(path))?;
        let path = path.to_path_buf();
        Ok(Self::Live(Standing { path, root, finished: false, replaced, _claim: claim, _unfinished: unfinished }))
    }

    /// Whether the store stands, or is to stand, under its own name while it is written.
    pub(super) fn is_live(&self) -> bool {
        matches!(self, Self::Live(_) | Self::Joined(Joined { is_live: true, .. }))
    }

    /// Whether another process looks after it.
    pub(super) fn is_joined(&self) -> bool {
        matches!(self, Self::Joined(_))
    }

    /// The folder.
    pub(super) fn folder(&self) -> &Path {
        match self {
            Self::Hidden(hidden) => hidden.partial.path(),
            Self::Live(standing) => &standing.path,
            Self::Joined(joined) => &joined.folder,
        }
    }

    /// Puts what is whole into its place.
    pub(super) fn finish(self, path: &Path, overwrite: bool, root: &Root) -> Result<()> {
        match &self {
            Self::Live(standing) => standing.root.check_place(),
            // A live store says once more how far it is, so its sums come last.
            Self::Hidden(_) => root.write_sums(),
            Self::Joined(_) => return root.flush_shards().map_err(|error| error.at(path)),
        }
        .map_err(|error| error.at(path))?;
        sync_tree(self.folder()).map_err(|error| error.at(path))?;
        match self {
            Self::Hidden(hidden) => hidden.finish(path, overwrite),
            Self::Live(standing) => standing.finish(),
            Self::Joined(_) => Ok(()),
        }
    }
}

impl Hidden {
    fn finish(self, path: &Path, overwrite: bool) -> Result<()> {
        check_target(path, overwrite)?;
        let fault = |error: std::io::Error| io_error("the output cannot be put in its place", &error).at(path);
        if exists(path) {
            let mut old = self.partial.path().as_os_str().to_owned();
            old.push(REPLACED);
            let old = PathBuf::from(old);
            self.unfinished.finish(|| {
                fs::rename(path, &old).map_err(fault)?;
                if let Err(error) = fs::rename(self.partial.path(), path) {
                    fs::rename(&old, path).map_err(fault)?;
                    return Err(fault(error));
                }
                Ok(())
            })?;
            let _goes = Unfinished::new(&old);
            let left = |error| io_error("the output is complete, but the one it replaces cannot be removed", &error);
            fs::remove_dir_all(&old).map_err(|error| left(error).at(&old))?;
        } else {
            self.unfinished.finish(|| fs::rename(self.partial.path(), path)).map_err(fault)?;
        }
        // The folder has its final name: nothing is left to clean up.
        let _ = self.partial.keep();
        Ok(())
    }
}

impl Standing {
    fn finish(mut self) -> Result<()> {
        let _ = fs::remove_dir(self.path.join(GROWING));
        self.root.tell(LiveState::Complete, 1.0).map_err(|error| error.at(&self.path))?;
        self.finished = true;
        self.root.write_sums().map_err(|error| error.at(&self.path))?;
        Ok(())
    }
}

impl Drop for Standing {
    fn drop(&mut self) {
        if self.finished {
            return;
        }
        if self.root.check_place().is_err() {
            return;
        }
        let _ = fs::remove_dir_all(self.path.join(GROWING));
        self.root.interrupt();
        // Where nothing can be seen in it, it is of no use.
        if self.root.written() == 0
            && fs::remove_dir_all(&self.path).is_ok()
            && let Some(aside) = self.replaced.take()
        {
            aside.put_back(&self.path);
        }
    }
}

/// An empty folder beside the one that a store is to have; what killed runs left of the same store goes.
fn hidden_folder(path: &Path) -> Result<TempDir> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let folder = path.parent().unwrap_or(Path::new("."));
    abandoned::remove(folder, &name, is_store);
    tempfile::Builder::new()
        .prefix(&format!("{}{}-", abandoned::prefix(&name), std::process::id()))
        .tempdir_in(folder)
        .map_err(|error| io_error("the output cannot be created in its folder", &error).at(path))
}

fn exists(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok()
}

/// Whether a folder is a Zarr store, of version 2 or 3.
#[must_use]
pub fn is_store(path: &Path) -> bool {
    ["zarr.json", ".zgroup", ".zattrs", ".zarray"].iter().any(|name| path.join(name).is_file())
}

/// Puts back the store that a killed run had set aside before anything of its own was to be seen at `path`.
pub(super) fn put_back(path: &Path) {
    let is_empty = |path: &Path| {
        let has_nothing = || fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_none());
        let has_begun = || live(path).is_some_and(|live| live.state == LiveState::Interrupted && live.written == 0);
        !exists(path) || has_nothing() || has_begun()
    };
    abandoned::put_back(path, is_empty);
}

/// Refuses a place that something is at which may not go.
pub(super) fn check_target(path: &Path, overwrite: bool) -> Result<()> {
    if !exists(path) {
        return Ok(());
    }
    let is_live = live(path).map(|live| live.state);
    if is_live == Some(LiveState::Running) {
        let what = "another run writes this output, live; wait for its end, or choose another name";
        return Err(Error::usage(what).at(path));
    }
    if !overwrite {
        let what = match is_live {
            Some(LiveState::Interrupted) => {
                "the output is there, left incomplete by a run that was interrupted; give --overwrite to make it anew, or \
                 choose another name"
            }
            _ => "the output exists already; choose another name, or give --overwrite to replace it",
        };
        return Err(Error::usage(what).at(path));
    }
    if is_store(path) {
        return Ok(());
    }
    let what = "this is no Zarr store, so --overwrite does not replace it; remove it yourself or choose another name";
    Err(Error::usage(what).at(path))
}
