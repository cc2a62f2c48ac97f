//! Where the times of a series lie until all of them are there: in the folder of the run's checkpoints, so that `--resume` finds those
//! that are whole, or, without checkpoints, in a hidden folder beside the output that goes with the run.

use std::fs;
use std::ops::Range;
use std::path::PathBuf;

use serde_json::Value;

use crate::cli::args::common::SegmentArgs;
use crate::cli::inputs::identity::identity;
use crate::cli::outputs::survival::{checkpoints, checkpoints_of, folder};
use crate::cli::terminal::console::Console;
use crate::error::{Error, Result};
use crate::exec::Progress;
use crate::io::ome_zarr::{TIMES, is_store, time_name};
use crate::job::resources::folder_of;
use crate::store::HiddenFolder;
use crate::store::checkpoint::{Checkpoints, Identity};

/// The folder of the times.
pub(super) struct Work {
    path: PathBuf,
    checkpoints: Option<Checkpoints>,
    _hidden: Option<HiddenFolder>,
}

impl Work {
    /// Begins one, or finds that of the run that is gone on with.
    ///
    /// # Errors
    /// When another run works there, or what lies there is of another one, or the folder cannot be made.
    pub(super) fn begin(args: &SegmentArgs, typed: &[String], console: &Console) -> Result<Self> {
        let output = &args.output;
        let kept = match (output.store(), folder(output)) {
            (Some(_), Some(folder)) => {
                checkpoints(output, || identity(typed), console)?.map(|checkpoints| (folder, checkpoints))
            }
            _ => None,
        };
        let Some((folder, checkpoints)) = kept else {
            let beside = output.store().map_or_else(std::env::temp_dir, |store| folder_of(store).to_path_buf());
            let hidden = HiddenFolder::create(&beside)
                .map_err(|e| Error::from_io("cannot make a folder for the times", &e).at(&beside))?;
            return Ok(Self { path: hidden.path().to_path_buf(), checkpoints: None, _hidden: Some(hidden) });
        };
        // From here on others find that somebody works there, and `--resume` whose times these are.
        let failed = |e: std::io::Error| Error::from_io("cannot make the folder of the checkpoints", &e).at(&folder);
        checkpoints.save(TIMES, Vec::new(), (&[], &[]), &|| Ok(()), None).map_err(failed)?;
        let path = folder.join(TIMES);
        if !output.survive.resume && path.exists() {
            fs::remove_dir_all(&path).map_err(failed)?;
        }
        fs::create_dir_all(&path).map_err(failed)?;
        Ok(Self { path, checkpoints: Some(checkpoints), _hidden: None })
    }

    /// What tells the run from others; none where it takes no checkpoints.
    pub(super) fn identity(&self) -> Option<&Identity> {
        self.checkpoints.as_ref().map(Checkpoints::identity)
    }

    /// The store of a time.
    pub(super) fn store(&self, time: u32) -> PathBuf {
        self.path.join(format!("{}.zarr", time_name(time)))
    }

    /// The report of a time that has no store.
    pub(super) fn report_file(&self, time: u32) -> PathBuf {
        self.path.join(format!("{}.json", time_name(time)))
    }

    /// The store of a time, where it has one.
    pub(super) fn store_there(&self, time: u32) -> Option<PathBuf> {
        Some(self.store(time)).filter(|store| is_store(store))
    }

    /// Whether there is something to go on with in a time.
    pub(super) fn has_checkpoint(&self, time: u32) -> bool {
        Checkpoints::lie_in(&checkpoints_of(&self.store(time)))
    }

    /// The report of a time that is done: its store is whole, and files beside it are there.
    pub(super) fn done(&self, time: u32, files: &[PathBuf]) -> Option<Value> {
        let is_done = self.store_there(time).is_some() && files.iter().all(|file| file.exists());
        is_done.then(|| self.report(time).ok()).flatten()
    }

    /// The report of a time that was run.
    ///
    /// # Errors
    /// When it cannot be read.
    pub(super) fn report(&self, time: u32) -> Result<Value> {
        let path = self.store_there(time).map_or_else(|| self.report_file(time), |store| store.join("report.json"));
        let text = fs::read(&path).map_err(|e| Error::from_io("the report of a time cannot be read", &e).at(&path))?;
        serde_json::from_slice(&text)
            .map_err(|e| Error::failed(format!("the report of a time is damaged: {e}")).caused_by(e).at(&path))
    }

    /// Leaves what `--resume` goes on with where the run did not come to its end, and says so; else all of it goes.
    pub(super) fn settle(&self, result: &Result<()>, console: &Console, times: Range<u32>) {
        let Some(checkpoints) = &self.checkpoints else { return };
        let done = times.clone().filter(|&time| self.store_there(time).is_some()).count();
        let began = times.clone().any(|time| self.has_checkpoint(time));
        let is_over = result.as_ref().err().is_none_or(|error| matches!(error.exit_code(), 2 | 3));
        if !is_over && (done > 0 || began) {
            console.note(&format!("{done} of {} times are done; --resume goes on with the others", times.len()));
            return;
        }
        // What cannot be removed takes room and is in nobody's way.
        let _ = fs::remove_dir_all(&self.path);
        checkpoints.clear();
    }
}
