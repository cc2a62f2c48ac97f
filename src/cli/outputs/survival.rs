//! How a run survives its end: where its checkpoints go, and what `--resume` finds.

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::cli::args::common::OutputArgs;
use crate::cli::args::survive::Checkpoint;
use crate::cli::inputs::identity::identity;
use crate::cli::terminal::console::{Console, Voice};
use crate::cli::terminal::signals::wish;
use crate::cli::terminal::text::bytes;
use crate::error::{Error, Result, one_line};
use crate::exec::{Engine, Progress, SavePoints, share_checkpoints};
use crate::io::ome_zarr::{LiveState, is_store, live};
use crate::store::checkpoint::{Checkpoints, Identity, difference};

/// What follows the name of a store in that of the folder of its run's checkpoints.
const ENDING: &str = ".checkpoint";

/// The folder of a run's checkpoints, where it takes some.
pub(crate) fn folder(output: &OutputArgs) -> Option<PathBuf> {
    match (&output.survive.checkpoint, output.store()) {
        (Some(Checkpoint::Folder(folder)), _) => Some(folder.clone()),
        (None, Some(store)) => Some(checkpoints_of(store)),
        _ => None,
    }
}

/// The folder of the checkpoints of a run that writes a store, where no other is named.
pub(crate) fn checkpoints_of(store: &Path) -> PathBuf {
    let mut name = store.file_name().unwrap_or_default().to_owned();
    name.push(ENDING);
    store.with_file_name(name)
}

/// Looks at what an earlier run left before anything is read; true where all of it is there already. What a run that is gone on
/// with had begun may be replaced.
///
/// # Errors
/// When there is nothing to go on with where `--resume` says so, or something that would be lost.
pub(crate) fn finished_before(output: &mut OutputArgs, files: &[Option<PathBuf>], typed: &[String]) -> Result<bool> {
    let folder = folder(output);
    let has_checkpoints = folder.as_deref().is_some_and(Checkpoints::lie_in);
    check_apart(folder.as_deref(), output.store())?;
    if !output.survive.resume {
        return match &folder {
            Some(folder) if has_checkpoints && !output.overwrite => Err(Checkpoints::would_be_lost(folder)),
            _ => Ok(false),
        };
    }
    if folder.is_none() {
        let what = "--resume needs to know where the checkpoints are: give the store with -o that the run was to write, or their folder with --checkpoint";
        return Err(Error::usage(what));
    }
    let Some(identity) = identity(typed)? else {
        let what =
            "a run that reads standard input or a pipe takes no checkpoints and cannot be gone on with; give it a file";
        return Err(Error::usage(what));
    };
    let is_whole = |store: &Path| is_store(store) && live(store).is_none_or(|live| live.state == LiveState::Complete);
    let is_there = |file: &Option<PathBuf>| file.as_ref().is_none_or(|file| file.exists());
    if let Some(store) = output.store().filter(|store| is_whole(store) && !has_checkpoints)
        && files.iter().all(is_there)
    {
        check_same(store, &identity)?;
        // That run may have been ended while it removed its checkpoints.
        if let Some((rest, _)) = folder.and_then(|folder| Checkpoints::resume(&folder, identity).ok()) {
            rest.clear();
        }
        let console = Console::new(Voice::of_run(output));
        console.note(&format!("{} is complete; there is nothing to go on with", store.display()));
        return Ok(true);
    }
    // Only what the run that is gone on with has begun or made may go without leave.
    let was_cut_off = |store: &Path| live(store).is_some_and(|live| live.state == LiveState::Interrupted);
    let has_files = files.iter().flatten().any(|file| file.exists());
    let was_made = |store: &Path| has_checkpoints && is_whole(store) && check_same(store, &identity).is_ok();
    output.overwrite |= output.store().is_some_and(|store| (was_cut_off(store) && !has_files) || was_made(store));
    Ok(false)
}

/// Refuses checkpoints within the store that the run writes.
fn check_apart(folder: Option<&Path>, store: Option<&Path>) -> Result<()> {
    let full = |path: Option<&Path>| path.and_then(|path| std::path::absolute(path).ok());
    match full(folder).zip(full(store)) {
        Some((folder, store)) if folder.starts_with(&store) => {
            let what = "is for checkpoints and lies in the store that the run writes; name another with --checkpoint";
            Err(Error::usage(what).at(&folder))
        }
        _ => Ok(()),
    }
}

/// Refuses to take a finished store for that of the run that was typed where another one made it.
fn check_same(store: &Path, now: &Identity) -> Result<()> {
    let report = std::fs::read(store.join("report.json")).unwrap_or_default();
    let report: serde_json::Value = serde_json::from_slice(&report).unwrap_or_default();
    let known: Option<BTreeMap<String, String>> = serde_json::from_value(report["fingerprint"].clone()).ok();
    let then = if let Some(known) = known.filter(|known| !known.is_empty()) {
        known.into_iter().collect()
    } else {
        // A run without checkpoints.
        let made: Option<Vec<String>> = serde_json::from_value(report["arguments"].clone()).ok();
        made.map(|made| identity(&made)).transpose()?.flatten().unwrap_or_default()
    };
    let Some(difference) = difference(&then, now) else { return Ok(()) };
    let what = format!(
        "is complete, and of another run: {difference}; choose another output, or give --overwrite in place of --resume"
    );
    Err(Error::usage(what).at(store))
}

/// The engine of a run that puts by what it solves, and goes on from what was put by. What its inputs hold is looked at here where it is
/// not `known` before. Of several ranks the first one looks, and tells the others.
///
/// # Errors
/// When another run works there, what lies there is of another one, or an input cannot be read.
pub(crate) fn survivable(
    engine: Engine,
    (output, typed): (&OutputArgs, &[String]),
    known: Option<&Identity>,
    console: &dyn Progress,
) -> Result<Engine> {
    let identity = || known.map_or_else(|| identity(typed), |known| Ok(Some(known.clone())));
    // What others wait for is looked at when all of them have seen what is there.
    engine.comm().any(false)?;
    let found = if engine.comm().rank() == 0 { checkpoints(output, identity, console)? } else { None };
    let found = share_checkpoints(engine.comm(), found)?;
    let every = output.survive.checkpoint_every;
    Ok(engine.with_save_points(found.map(|found| Arc::new(SavePoints::new(found, every, wish())))))
}

/// The checkpoints of a run, with what it goes on from; none where it takes none.
///
/// # Errors
/// As [`save_points`].
pub(crate) fn checkpoints(
    output: &OutputArgs,
    identity: impl FnOnce() -> Result<Option<Identity>>,
    console: &dyn Progress,
) -> Result<Option<Checkpoints>> {
    let asks = output.survive.asks();
    let Some(folder) = folder(output) else {
        if asks && output.survive.checkpoint.is_none() {
            console.note("without a store there are no checkpoints; name a folder for them with --checkpoint");
        }
        return Ok(None);
    };
    let Some(identity) = identity()? else {
        if asks {
            console.note("a run that reads standard input or a pipe takes no checkpoints; give it a file");
        }
        return Ok(None);
    };
    Ok(Some(if output.survive.resume {
        let (checkpoints, found) = Checkpoints::resume(&folder, identity)?;
        found.torn.iter().for_each(|torn| console.note(&format!("a checkpoint is passed over: {torn}")));
        console.note(&match found.stages {
            0 => format!("{} holds nothing to go on with; the run begins anew", folder.display()),
            stages => format!("goes on from the checkpoint in {}, of {stages} stage(s)", folder.display()),
        });
        checkpoints
    } else {
        if output.survive.checkpoint.is_some() {
            check_can_be_made(&folder)?;
        }
        Checkpoints::begin(&folder, identity, output.overwrite)?
    }))
}

/// What became of a run, which needs so many bytes of disk at most: where a full one ended it, with what it needs, and how it is gone
/// on with.
pub(crate) fn told_of_room<R>(result: Result<R>, most: u64, output: &OutputArgs) -> Result<R> {
    result.map_err(|error| {
        let system = std::error::Error::source(&error).and_then(|source| source.downcast_ref::<std::io::Error>());
        let is_full =
            |error: &std::io::Error| matches!(error.kind(), ErrorKind::StorageFull | ErrorKind::QuotaExceeded);
        if most == 0 || !system.is_some_and(is_full) {
            return error;
        }
        let kept = folder(output).filter(|folder| Checkpoints::lie_in(folder)).map_or(String::new(), |folder| {
            let folder = one_line(folder.display().to_string());
            format!("; when there is room --resume goes on from the checkpoint in {folder}")
        });
        error.reworded(|words| {
            format!("{words}; temporary fields and output of this run take up to {} of disk{kept}", bytes(most))
        })
    })
}

/// Refuses a folder that was named and that nothing could be put into, before the run has solved anything.
fn check_can_be_made(folder: &Path) -> Result<()> {
    let full = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
    let Some(there) = full.ancestors().find(|path| path.symlink_metadata().is_ok()) else { return Ok(()) };
    // A file without a name leaves nothing behind.
    tempfile::tempfile_in(there).map(drop).map_err(|error| {
        let what = "no checkpoint can be put there; name another folder with --checkpoint, or give --checkpoint off";
        Error::from_io(what, &error).at(folder)
    })
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    /// What a command line of one flag for its output holds.
    #[derive(Parser)]
    struct Typed {
        #[command(flatten)]
        output: OutputArgs,
    }

    #[test]
    fn a_full_disk_is_told_with_what_is_needed_and_what_was_left() {
        let dir = tempfile::tempdir().unwrap();
        let store = dir.path().join("x.zarr");
        let output = Typed::parse_from(["strandline".as_ref(), "-o".as_ref(), store.as_os_str()]).output;
        let told = |error: std::io::Error, most: u64| {
            let failed = Error::from_io("a shard cannot be written", &error).at(&store);
            told_of_room::<()>(Err(failed), most, &output).unwrap_err().to_string()
        };
        let full = || std::io::Error::from_raw_os_error(libc::ENOSPC);
        let said = told(full(), 3 << 30);
        assert!(said.ends_with("; temporary fields and output of this run take up to 3 GiB of disk"), "{said}");
        let checkpoints = Checkpoints::begin(&checkpoints_of(&store), Vec::new(), false).unwrap();
        checkpoints.save("moving", Vec::new(), (&[], &[]), &|| Ok(()), None).unwrap();
        let said = told(full(), 3 << 30);
        assert!(said.contains("of disk; when there is room --resume goes on from the checkpoint in "), "{said}");
        assert!(said.ends_with("x.zarr.checkpoint"), "{said}");
        assert!(!told(std::io::Error::from_raw_os_error(libc::EACCES), 3 << 30).contains("of disk"));
    }
}
