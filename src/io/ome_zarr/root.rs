//! The document at a store's root: what its image is and, of a live store, whether somebody still writes it and how far that is.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::{Mutex, OnceLock, PoisonError};

use serde_json::{Map, Value, json};

use super::abandoned;
use super::metadata;
use super::sums::{FileSum, ShardSums};
use super::version::OmeVersion;
use crate::error::{Error, Result};

/// The attribute of live stores, beside `ome`.
pub(super) const ATTRIBUTE: &str = "strandline";

/// Whether a live store is still written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LiveState {
    /// A run writes it.
    Running,
    /// All of it is there.
    Complete,
    /// The run that wrote it has ended before it was complete.
    Interrupted,
}

impl LiveState {
    /// As the attribute says it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Running => "running",
            Self::Complete => "complete",
            Self::Interrupted => "interrupted",
        }
    }
}

/// What a live store says of itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Live {
    /// Whether somebody writes it.
    pub state: LiveState,
    /// The share of the run that is done, 0 to 1.
    pub done: f64,
    /// Grows with each shard.
    pub written: u64,
}

/// The document of one store that is being written.
#[derive(Debug)]
pub struct Root {
    folder: PathBuf,
    version: OmeVersion,
    said: Mutex<Said>,
    written: AtomicU64,
    sums: ShardSums,
    /// Device and number of a live store's folder: somebody may put another in its place.
    identity: OnceLock<(u64, u64)>,
}

#[derive(Debug, Default)]
struct Said {
    ome: Option<Map<String, Value>>,
    live: Option<Live>,
}

impl Root {
    /// That of a store in `folder`, which says nothing yet.
    pub(super) fn new(folder: &Path, version: OmeVersion) -> Self {
        Self {
            folder: folder.to_path_buf(),
            version,
            said: Mutex::default(),
            written: AtomicU64::new(0),
            sums: ShardSums::default(),
            identity: OnceLock::new(),
        }
    }

    /// The version of the whole store.
    pub(super) fn version(&self) -> OmeVersion {
        self.version
    }

    /// Counts a shard that was written at a path, with the sum of its bytes; one without a byte is none.
    pub(super) fn wrote(&self, path: &Path, sum: FileSum) {
        if sum.length > 0 {
            self.written.fetch_add(1, Relaxed);
        }
        if let Ok(inside) = path.strip_prefix(&self.folder) {
            self.sums.put(&inside.to_string_lossy().replace('\\', "/"), sum);
        }
    }

    /// The folder of the store.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Whether the store stands under its own name while it is written.
    pub(super) fn is_live(&self) -> bool {
        self.said.lock().unwrap_or_else(PoisonError::into_inner).live.is_some()
    }

    /// The shards below a folder of the store that are written, by their paths in the store.
    pub(super) fn written_below(&self, folder: &Path) -> Vec<(String, FileSum)> {
        let Ok(inside) = folder.strip_prefix(&self.folder) else { return Vec::new() };
        self.sums.beginning(&format!("{}/", inside.to_string_lossy().replace('\\', "/")))
    }

    /// The sums of all shards that are written, by their paths in the store.
    pub(super) fn all_sums(&self) -> Vec<(String, FileSum)> {
        self.sums.beginning("")
    }

    /// Takes over the sums of shards that another process of the run has written.
    pub(super) fn take_sums(&self, sums: Vec<(String, FileSum)>) {
        self.written.fetch_add(sums.len() as u64, Relaxed);
        for (path, sum) in sums {
            self.sums.put(&path, sum);
        }
    }

    /// Sees to it that all shards written here are on the disk.
    pub(super) fn flush_shards(&self) -> Result<()> {
        let flush = |path: &str| std::fs::File::open(self.folder.join(path)).and_then(|file| file.sync_all());
        self.sums
            .beginning("")
            .iter()
            .try_for_each(|(path, _)| flush(path))
            .map_err(|error| super::files::io_error("the shards cannot be written out", &error))
    }

    /// Writes the checksums of all files, which are whole.
    pub(super) fn write_sums(&self) -> Result<()> {
        self.sums.write(&self.folder)
    }

    /// From now on the store's folder has to be the one that is there.
    pub(super) fn stay(&self) {
        if let Some(folder) = self.folder_now() {
            let _ = self.identity.set(folder);
        }
    }

    /// Refuses to go on in a folder that has taken the place of a live store's.
    pub(super) fn check_place(&self) -> Result<()> {
        match self.identity.get() {
            Some(folder) if self.folder_now() != Some(*folder) => Err(Error::failed(
                "the live store was removed, moved or replaced while it was written; leave it where it is until the run ends",
            )),
            _ => Ok(()),
        }
    }

    fn folder_now(&self) -> Option<(u64, u64)> {
        identity(&self.folder)
    }

    /// Shards that were written.
    pub(super) fn written(&self) -> u64 {
        self.written.load(Relaxed)
    }

    /// Says what the image at the root is.
    pub(super) fn describe(&self, ome: Map<String, Value>) -> Result<()> {
        self.change(|said| said.ome = Some(ome))
    }

    /// Says how far a live store is.
    ///
    /// # Errors
    /// When the document cannot be written.
    pub fn tell(&self, state: LiveState, done: f64) -> Result<()> {
        let done = if state == LiveState::Complete { 1.0 } else { (done.clamp(0.0, 1.0) * 1e4).round() / 1e4 };
        let live = Live { state, done, written: self.written() };
        self.change(|said| said.live = Some(live))
    }

    /// Says that nobody goes on with it, as far as it was.
    pub(super) fn interrupt(&self) {
        let said = self.said.lock().unwrap_or_else(PoisonError::into_inner).live;
        if let Some(live) = said.filter(|live| live.state == LiveState::Running) {
            // Readers find out by its lock too.
            let _ = self.tell(LiveState::Interrupted, live.done);
        }
    }

    fn change(&self, change: impl FnOnce(&mut Said)) -> Result<()> {
        // Written under the lock: what is said last stays.
        let mut said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
        self.check_place()?;
        change(&mut said);
        let live = said.live.map(|live| {
            let value = json!({ "state": live.state.name(), "done": live.done, "written": live.written });
            (ATTRIBUTE.to_owned(), value)
        });
        self.version.write(&self.folder, &metadata::group_with(said.ome.clone(), live))
    }
}

/// What tells a folder from another of its name, where the system has such numbers.
fn identity(folder: &Path) -> Option<(u64, u64)> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let found = std::fs::symlink_metadata(folder).ok()?;
        Some((found.dev(), found.ino()))
    }
    #[cfg(not(unix))]
    {
        let _ = folder;
        None
    }
}

/// What the store in a folder says of itself, where it is live. One that says `running` and is nobody's is interrupted: the
/// lock on its folder goes with the process that writes it, whatever ends that.
#[must_use]
pub fn live(folder: &Path) -> Option<Live> {
    let document = |name: &str| serde_json::from_slice::<Value>(&std::fs::read(folder.join(name)).ok()?).ok();
    let attributes = document("zarr.json").map(|mut root| root["attributes"].take()).or_else(|| document(".zattrs"))?;
    let said = attributes.get(ATTRIBUTE)?;
    let state = match said["state"].as_str()? {
        "running" if abandoned::is_claimed(folder) => LiveState::Running,
        "complete" => LiveState::Complete,
        _ => LiveState::Interrupted,
    };
    Some(Live { state, done: said["done"].as_f64()?, written: said["written"].as_u64()? })
}
