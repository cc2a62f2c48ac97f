//! What an input is: its length, its times, and what it holds, as a hash. Files whose length and times are what they were are
//! taken for unchanged and not read again; of others the hash decides. An input of several files is all of them.

use std::fs::{self, File, Metadata};
use std::io::{self, Read};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;

use serde::{Deserialize, Serialize};

use crate::cli::inputs::content::files_of;

/// Bytes that are read at a time.
const PIECE: usize = 1 << 18;

/// An input as it was at some time.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Input {
    /// As the list has it.
    pub(crate) path: String,
    #[serde(flatten)]
    pub(crate) looks: Looks,
    /// BLAKE3; null where it changed while it was read, or was not read to its end.
    pub(crate) hash: Option<String>,
}

/// What can be told of an input without reading it: bytes, and when its content and its entry changed last, in seconds and
/// nanoseconds; of several files the sum, the latest, and a hash of those of all of them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Looks {
    pub(crate) length: u64,
    pub(crate) mtime: [i64; 2],
    pub(crate) ctime: [i64; 2],
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) files: Option<String>,
}

impl Looks {
    fn of_file(is: &Metadata) -> Self {
        Self {
            length: is.len(),
            mtime: [is.mtime(), is.mtime_nsec()],
            ctime: [is.ctime(), is.ctime_nsec()],
            files: None,
        }
    }

    /// Those of a file or folder.
    ///
    /// # Errors
    /// When it is not there or cannot be looked at.
    pub(crate) fn of(path: &Path) -> io::Result<Self> {
        let files = files_of(path)?;
        if let [(_, file)] = files.as_slice() {
            return Ok(Self::of_file(&fs::metadata(file)?));
        }
        let (mut all, mut hasher) = (Self::default(), blake3::Hasher::new());
        for (name, file) in files {
            let one = Self::of_file(&fs::metadata(&file)?);
            hasher.update(format!("{}\0{}\0{:?}{:?}\n", name.display(), one.length, one.mtime, one.ctime).as_bytes());
            all.length += one.length;
            (all.mtime, all.ctime) = (all.mtime.max(one.mtime), all.ctime.max(one.ctime));
        }
        Ok(Self { files: Some(hasher.finalize().to_hex().to_string()), ..all })
    }
}

/// The hash of all that a file or folder holds; none where `stop` was set meanwhile.
///
/// # Errors
/// When it cannot be read.
pub(crate) fn hash(path: &Path, stop: &AtomicBool) -> io::Result<Option<String>> {
    let mut hasher = blake3::Hasher::new();
    let files = files_of(path)?;
    let mut is_whole = true;
    if let [(_, file)] = files.as_slice() {
        is_whole = take(&mut hasher, file, stop)?;
    } else {
        for (name, file) in files {
            let mut one = blake3::Hasher::new();
            is_whole &= take(&mut one, &file, stop)?;
            hasher.update(format!("{}\0{}\n", name.display(), one.finalize().to_hex()).as_bytes());
        }
    }
    Ok(is_whole.then(|| hasher.finalize().to_hex().to_string()))
}

fn take(hasher: &mut blake3::Hasher, path: &Path, stop: &AtomicBool) -> io::Result<bool> {
    let mut file = File::open(path)?;
    let mut piece = vec![0; PIECE];
    loop {
        if stop.load(Relaxed) {
            return Ok(false);
        }
        match file.read(&mut piece)? {
            0 => return Ok(true),
            n => hasher.update(&piece[..n]),
        };
    }
}

/// Reads the inputs of an item that runs meanwhile. What changes under it has no hash, and is taken for changed next time.
pub(crate) fn read(files: &[(String, PathBuf)], stop: &AtomicBool) -> Vec<Input> {
    let one = |(name, path): &(String, PathBuf)| {
        let looks = Looks::of(path).unwrap_or_default();
        let hash = hash(path, stop).ok().flatten();
        let is_same = Looks::of(path).is_ok_and(|now| now == looks);
        Input { path: name.clone(), looks, hash: hash.filter(|_| is_same) }
    };
    files.iter().map(one).collect()
}

/// What changed of an item's inputs since they were read, and the inputs as they look now.
pub(crate) fn changed(files: &[(String, PathBuf)], before: &[Input], stop: &AtomicBool) -> (Vec<String>, Vec<Input>) {
    let (mut names, mut now) = (Vec::new(), Vec::new());
    for (name, path) in files {
        let looks = Looks::of(path).unwrap_or_default();
        let was = before.iter().find(|input| input.path == *name);
        let hash = match was {
            Some(was) if was.looks == looks => was.hash.clone(),
            // Of another length it holds something else.
            Some(was) if was.looks.length == looks.length => hash(path, stop).ok().flatten(),
            _ => None,
        };
        if hash.is_none() || was.is_none_or(|was| was.hash != hash) {
            names.push(name.clone());
        }
        now.push(Input { path: name.clone(), looks, hash });
    }
    (names, now)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn content_decides_where_times_differ() {
        let folder = tempfile::tempdir().unwrap();
        let go = AtomicBool::new(false);
        let (file, slices) = (folder.path().join("a.csv"), folder.path().join("slices"));
        fs::create_dir_all(slices.join("deep")).unwrap();
        fs::write(&file, "1,2,3").unwrap();
        fs::write(slices.join("deep/0.tif"), "zero").unwrap();
        fs::write(slices.join("1.tif"), "one").unwrap();
        let files = [("a.csv".to_string(), file.clone()), ("slices".to_string(), slices.clone())];
        let before = read(&files, &go);
        let names = || changed(&files, &before, &go).0;
        assert!(names().is_empty());
        assert_eq!(before[0].hash.as_deref(), Some(&*blake3::hash(b"1,2,3").to_hex()));
        fs::write(&file, "1,2,3").unwrap();
        fs::write(slices.join("deep/0.tif"), "zero").unwrap();
        assert!(names().is_empty(), "the same content again");
        assert!(read(&files, &AtomicBool::new(true)).iter().all(|input| input.hash.is_none()));
        fs::write(&file, "1,2,4").unwrap();
        assert_eq!(names(), ["a.csv"]);
        fs::rename(slices.join("1.tif"), slices.join("2.tif")).unwrap();
        assert_eq!(names(), ["a.csv", "slices"]);
    }
}
