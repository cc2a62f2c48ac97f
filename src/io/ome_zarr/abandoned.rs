//! What killed runs leave behind: a store in the making that nobody goes on with.
//!
//! A run keeps a lock (flock(2)) on the folder in which it builds its store. The system lets go of it when the process
//! ends, whatever ends it; so a folder that can be locked is abandoned. A name with a process's number would not tell:
//! numbers come again, and other machines have their own. Where folders cannot be locked, nothing is ever removed.

use std::fs::{self, File};
use std::path::Path;

/// Locks a folder in the making for as long as the file is open.
pub(super) fn claim(folder: &Path) -> Option<File> {
    let folder = File::open(folder).ok()?;
    folder.try_lock().ok().map(|()| folder)
}

/// Whether somebody works on a folder; yes where that cannot be found out.
pub(super) fn is_claimed(folder: &Path) -> bool {
    let unlocked = |folder: File| folder.try_lock_shared().is_ok();
    File::open(folder).is_ok_and(|folder| !unlocked(folder))
}

/// The beginning of the hidden names under which the store `name` is made; a process's number, `-` and letters follow.
pub(super) fn prefix(name: &str) -> String {
    format!(".{name}.partial-")
}

/// The end of the hidden name that a store has while another one takes its place.
pub(super) const REPLACED: &str = "-replaced";

/// A store's name is longer by so much at most while it is made: by the dot, `.partial-`, a number of 32 bits, `-`, six
/// letters and `-replaced`.
pub const LONGEST_ENDING: usize = 1 + 9 + 10 + 1 + 6 + REPLACED.len();

/// Removes what runs that are dead left of the store `name` in a folder. `is_store` tells what every store in the making
/// is from the moment on at which it is locked.
pub(super) fn remove(folder: &Path, name: &str, is_store: fn(&Path) -> bool) {
    let prefix = prefix(name);
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        let found = entry.file_name().to_string_lossy().into_owned();
        let Some((process, letters)) = found.strip_prefix(&prefix).and_then(|rest| rest.split_once('-')) else {
            continue;
        };
        let ours = process.bytes().all(|b| b.is_ascii_digit()) && letters.bytes().all(|b| b.is_ascii_alphanumeric());
        // A run that died while one store took another's place left both whole: which to keep is not ours to say.
        let whole = folder.join(format!("{found}{REPLACED}")).exists();
        if !ours || whole || !is_store(&path) {
            continue;
        }
        if let Some(_locked) = claim(&path) {
            // What cannot be removed is in nobody's way.
            let _ = fs::remove_dir_all(&path);
        }
    }
}

/// Puts back what runs that are dead had set aside for the store at `path`: the store that was there before goes to its place
/// where nothing has come to stand there. `is_empty` tells whether what stands there is of no use. Where something is, what was set
/// aside goes, as it would have gone with the end of the run.
pub(super) fn put_back(path: &Path, is_empty: impl Fn(&Path) -> bool) {
    let (Some(folder), Some(name)) = (path.parent(), path.file_name()) else { return };
    let prefix = prefix(&name.to_string_lossy());
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let found = entry.file_name().to_string_lossy().into_owned();
        let Some(making) = found.strip_prefix(&prefix).and_then(|rest| rest.strip_suffix(REPLACED)) else { continue };
        let ours = making.split_once('-').is_some_and(|(process, letters)| {
            process.bytes().all(|b| b.is_ascii_digit()) && letters.bytes().all(|b| b.is_ascii_alphanumeric())
        });
        // Beside it stands the whole store that was to take its place: which to keep is not ours to say.
        if !ours || folder.join(format!("{prefix}{making}")).exists() {
            continue;
        }
        let aside = entry.path();
        let Some(_locked) = claim(&aside) else { continue };
        if is_empty(path) {
            // A run that has come meanwhile is left alone.
            let claimed = claim(path);
            if path.exists() && (claimed.is_none() || fs::remove_dir_all(path).is_err()) {
                continue;
            }
            let _ = fs::rename(&aside, path);
        } else {
            let _ = fs::remove_dir_all(&aside);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_stores_that_nobody_makes_are_removed() {
        let folder = tempfile::tempdir().unwrap();
        let make = |name: &str| {
            let path = folder.path().join(name);
            fs::create_dir(&path).unwrap();
            fs::write(path.join("zarr.json"), "{}").unwrap();
            path
        };
        let dead = make(".out.zarr.partial-12-abcDEF");
        let living = make(".out.zarr.partial-12-abcDEG");
        let _claim = claim(&living).unwrap();
        let half_replaced = make(".out.zarr.partial-13-abcDEF");
        let replaced = make(".out.zarr.partial-13-abcDEF-replaced");
        let others = [make(".other.zarr.partial-12-abcDEF"), make(".out.zarr.partial-mine"), make("out.zarr")];
        let unlocked_yet = folder.path().join(".out.zarr.partial-14-abcDEF");
        fs::create_dir(&unlocked_yet).unwrap();
        remove(folder.path(), "out.zarr", |path| path.join("zarr.json").exists());
        assert!(!dead.exists());
        assert!([living, half_replaced, replaced, unlocked_yet].iter().chain(&others).all(|path| path.exists()));
    }
}
