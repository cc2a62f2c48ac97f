//! How a job is run: what it may use, who hears of it, and the store that gets its results.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::disk::Disk;
use super::resources::Resources;
use super::words::of_builders;
use crate::error::{Error, Result};
use crate::exec::{Budget, Cancel, Engine, Progress, Silent};
use crate::grid::digits::bytes;
use crate::io::ome_zarr::{Compression, OmeVersion, StoreWriter};

/// What was said of a run.
#[derive(Clone)]
pub(super) struct Run {
    pub(super) memory: Option<u64>,
    pub(super) threads: Option<usize>,
    pub(super) scratch: Option<PathBuf>,
    pub(super) cancel: Cancel,
    pub(super) progress: Arc<dyn Progress>,
    pub(super) store: Option<PathBuf>,
    pub(super) overwrite: bool,
    pub(super) compression: Compression,
    pub(super) ome: OmeVersion,
}

impl Default for Run {
    fn default() -> Self {
        Self {
            memory: None,
            threads: None,
            scratch: None,
            cancel: Cancel::default(),
            progress: Arc::new(Silent),
            store: None,
            overwrite: false,
            compression: Compression::default(),
            ome: OmeVersion::default(),
        }
    }
}

impl Run {
    /// What it may use.
    pub(super) fn resources(&self) -> Result<Resources> {
        Resources::new(self.memory, self.threads, self.scratch.as_deref(), self.store.as_deref())
    }

    /// The engine of a job that must hold so many bytes at the same time.
    pub(super) fn engine(&self, resources: &Resources, held: u64) -> Result<Engine> {
        let (budget, least) = (Budget { total: resources.memory }, Budget::least(held));
        if budget.total < least {
            return Err(Error::usage(format!(
                "this job must hold {} at the same time, and {} are allowed; give --memory of {least} bytes or more, or \
                 a coarser grid",
                bytes(least),
                bytes(budget.total)
            )));
        }
        resources.engine(&self.cancel, self.progress.clone())
    }

    /// Refuses a run that the disks cannot hold, and notes one that they may not.
    pub(super) fn check_disk(&self, disk: &Disk<'_>, notes: &mut Vec<String>) -> Result<()> {
        disk.check(|text| self.note(notes, text)).map(drop)
    }

    /// Begins the store, where one was asked for.
    pub(super) fn begin_store(&self) -> Result<Option<StoreWriter>> {
        let begin = |path| Ok(StoreWriter::create_as(self.ome, path, self.overwrite)?.packed(self.compression));
        self.store.as_deref().map(begin).transpose()
    }

    /// Hears what should be known, and tells it in the words of builders.
    pub(super) fn note(&self, notes: &mut Vec<String>, text: &str) {
        let text = of_builders(text);
        self.progress.note(&text);
        notes.push(text);
    }
}

/// Completes a store, unless the run was asked to end meanwhile.
pub(super) fn finish_store(engine: &Engine, store: Option<StoreWriter>) -> Result<()> {
    engine.check()?;
    store.map_or(Ok(()), StoreWriter::finish)
}

/// Where a mesh of a store is drawn to.
pub(super) fn mesh_file(store: Option<&StoreWriter>) -> Result<Option<PathBuf>> {
    store.map(|store| store.file("meshes/surface.ply")).transpose()
}

/// Takes a path by whatever it is called.
pub(super) fn path_of(path: impl AsRef<Path>) -> PathBuf {
    path.as_ref().to_path_buf()
}

/// The functions of a builder that say how it is run; `$run` is where it keeps that.
macro_rules! run_setters {
    ($($run:ident).+) => {
        /// Bytes of memory that the process may take; half of the machine's where this is left out. Fields that are larger
        /// than that lie in temporary files.
        pub fn memory(mut self, bytes: u64) -> Self {
            self.$($run).+.memory = Some(bytes);
            self
        }

        /// Threads that compute; one for each core where this is left out. Results do not depend on it.
        pub fn threads(mut self, threads: usize) -> Self {
            self.$($run).+.threads = Some(threads);
            self
        }

        /// The folder of temporary fields; that of TMPDIR where this is left out, else one beside the store.
        pub fn scratch(mut self, folder: impl AsRef<std::path::Path>) -> Self {
            self.$($run).+.scratch = Some($crate::job::run::path_of(folder));
            self
        }

        /// Ends the run early, with an error, once the flag is set.
        pub fn cancel(mut self, cancel: &$crate::exec::Cancel) -> Self {
            self.$($run).+.cancel = cancel.clone();
            self
        }

        /// Hears how the run goes on, and notes on what it was given.
        pub fn progress(mut self, progress: std::sync::Arc<dyn $crate::exec::Progress>) -> Self {
            self.$($run).+.progress = progress;
            self
        }

        /// Writes the results into an OME-Zarr store too, which is there when the run is done, whole.
        pub fn store(mut self, path: impl AsRef<std::path::Path>) -> Self {
            self.$($run).+.store = Some($crate::job::run::path_of(path));
            self
        }

        /// Replaces a store that is there already, when the new one is complete.
        pub fn overwrite(mut self) -> Self {
            self.$($run).+.overwrite = true;
            self
        }

        /// What is saved in packing the store: time where this is left out.
        pub fn compress(mut self, compression: $crate::io::ome_zarr::Compression) -> Self {
            self.$($run).+.compression = compression;
            self
        }

        /// The version of OME-Zarr that the store has: 0.5 where this is left out.
        pub fn ome(mut self, version: $crate::io::ome_zarr::OmeVersion) -> Self {
            self.$($run).+.ome = version;
            self
        }
    };
}

pub(super) use run_setters;
