//! Files of a store: written under a temporary name and renamed, so that what has its name is whole.
//!
//! Errors name no file: the store lies under a hidden name while it is made, and callers know what it will be called.

use std::fs::{self, File};
use std::hash::{BuildHasher, Hasher, RandomState};
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::error::{Error, Result};
use crate::store::begin_writeback;

/// Files of so many bytes take a disk a while.
const LARGE: u64 = 1 << 20;

/// An error of the operating system while writing, with what to do when the disk is full.
pub(super) fn io_error(what: &str, error: &std::io::Error) -> Error {
    match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
            Error::failed(format!("{what}: {error}; free some space or write to another disk")).caused_by_io(error)
        }
        _ => Error::from_io(what, error),
    }
}

/// Creates the folders that `path` lies in, where they are missing.
pub(super) fn create_parent(path: &Path) -> Result<()> {
    let parent = path.parent().unwrap_or(path);
    fs::create_dir_all(parent).map_err(|error| io_error("a folder cannot be created", &error))
}

/// A name beside a file that nobody else writes under: several ranks may describe the group that what they write lies in.
fn partial_of(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let unique = RandomState::new().build_hasher().finish();
    path.with_file_name(format!(".{name}.{unique:x}.partial"))
}

/// Writes a file through `write`, which says how many bytes it wrote; none leaves no file. Of several who write the same one at once the last
/// one's stands.
pub(super) fn write_whole(path: &Path, write: impl FnOnce(&mut dyn Write) -> Result<u64>) -> Result<u64> {
    create_parent(path)?;
    let partial = partial_of(path);
    let written = write_file(&partial, write).and_then(|bytes| {
        let place =
            |target: &Path| if bytes == 0 { remove_both(&partial, target) } else { fs::rename(&partial, target) };
        place(path).map_err(|error| io_error("a file cannot be put in its place", &error))?;
        Ok(bytes)
    });
    if written.is_err() {
        // The first error is the one to report.
        let _ = fs::remove_file(&partial);
    }
    written
}

fn write_file(path: &Path, write: impl FnOnce(&mut dyn Write) -> Result<u64>) -> Result<u64> {
    let file = File::create(path).map_err(|error| io_error("a file cannot be created", &error))?;
    let mut sink = BufWriter::new(file);
    let bytes = write(&mut sink)?;
    sink.flush().map_err(|error| io_error("a file cannot be written", &error))?;
    if bytes >= LARGE {
        begin_writeback(sink.get_ref());
    }
    Ok(bytes)
}

fn remove_both(partial: &Path, path: &Path) -> std::io::Result<()> {
    fs::remove_file(partial)?;
    match fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Writes `value` as readable JSON.
pub(super) fn write_json(path: &Path, value: &Value) -> Result<()> {
    let text = format!("{value:#}\n");
    write_whole(path, |sink| {
        sink.write_all(text.as_bytes()).map_err(|error| io_error("the metadata cannot be written", &error))?;
        Ok(text.len() as u64)
    })?;
    Ok(())
}

/// Hands every file below `folder` to the disk, so that a full disk or a lost server shows itself now.
pub(super) fn sync_tree(folder: &Path) -> Result<()> {
    let fault = |error: std::io::Error| io_error("a file cannot be written to disk", &error);
    for entry in fs::read_dir(folder).map_err(fault)? {
        let path = entry.map_err(fault)?.path();
        if path.is_dir() {
            sync_tree(&path)?;
        } else {
            File::open(&path).and_then(|file| file.sync_all()).map_err(fault)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/er/file");
        let result = write_whole(&path, |sink| {
            sink.write_all(b"half").unwrap();
            Err(Error::failed("no more"))
        });
        assert!(result.is_err());
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 0);
    }

    #[test]
    fn writing_nothing_removes_what_was_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        write_json(&path, &serde_json::json!({ "a": 1 })).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "{\n  \"a\": 1\n}\n");
        assert_eq!(write_whole(&path, |_| Ok(0)).unwrap(), 0);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[test]
    fn a_full_disk_says_what_to_do() {
        let error = io_error("the shard cannot be written", &ErrorKind::StorageFull.into());
        assert_eq!(error.exit_code(), 1);
        assert!(error.to_string().contains("free some space"), "{error}");
    }

    #[test]
    fn two_may_write_the_same_file_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("group").join("zarr.json");
        let document = serde_json::json!({ "a": 1 });
        write_whole(&path, |sink| {
            write_json(&path, &document)?;
            sink.write_all(b"{}").map_err(|error| io_error("no", &error))?;
            Ok(2)
        })
        .unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "{}");
        assert_eq!(fs::read_dir(folder.path().join("group")).unwrap().count(), 1);
    }
}
