//! Who works in a folder of checkpoints: a file that its run has locked (flock(2)), with its host, process and boot.

use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::Path;

use crate::error::{Error, Result};

/// The file's name.
pub(super) const LOCK: &str = "strandline.lock";

/// Takes the lock of a folder that is there. It goes with the process.
pub(super) fn lock(folder: &Path) -> Result<Option<File>> {
    if !folder.is_dir() {
        return Ok(None);
    }
    let path = folder.join(LOCK);
    // A link would have another file written, a pipe would be waited for.
    if path.symlink_metadata().is_ok_and(|found| !found.is_file()) {
        return Err(
            Error::usage("is no file of a run's; remove it, or name another folder with --checkpoint").at(&path)
        );
    }
    let failed = |error: &io::Error| {
        Error::from_io("cannot be written; name another folder with --checkpoint", error).at(folder)
    };
    let mut file = File::options().create(true).truncate(false).write(true).open(&path).map_err(|e| failed(&e))?;
    // A disk without locks has none for others either.
    if matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
        return Err(taken(folder, &path));
    }
    let read = |path: &str| fs::read_to_string(path).unwrap_or_default().trim().to_owned();
    let (host, boot) = (read("/proc/sys/kernel/hostname"), read("/proc/sys/kernel/random/boot_id"));
    file.set_len(0)
        .and_then(|()| writeln!(file, "host {host}, process {}, boot {boot}", std::process::id()))
        .map_err(|e| failed(&e))?;
    Ok(Some(file))
}

/// What is said where a run that goes on works in a folder.
pub(super) fn worker(folder: &Path) -> Option<Error> {
    let path = folder.join(LOCK);
    let is_file = path.symlink_metadata().is_ok_and(|found| found.is_file());
    let file = is_file.then(|| File::open(&path).ok())??;
    matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)).then(|| taken(folder, &path))
}

fn taken(folder: &Path, lock: &Path) -> Error {
    let who = fs::read_to_string(lock).unwrap_or_default();
    let what = format!("belongs to a run that goes on ({}); wait for it, or name another output", who.trim());
    Error::usage(what).at(folder)
}
