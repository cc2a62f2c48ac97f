//! The documents of a Zarr, of version 2 or 3: what a folder is by them, and what is wrong with those of which nothing can be shown.

use std::path::{Path, PathBuf};

use serde_json::Value;

use super::listing::file_name;

/// Documents of a store: of version 3, and of 2.
const DOCUMENTS: [&str; 4] = ["zarr.json", ".zattrs", ".zgroup", ".zarray"];
/// A file of metadata is shorter than this.
const MOST_BYTES: u64 = 16 << 20;

/// The document of a folder that cannot be understood, and why.
pub(super) fn fault(folder: &Path) -> Option<(PathBuf, String)> {
    let path = ["zarr.json", ".zattrs"].map(|name| folder.join(name)).into_iter().find(|path| path.exists())?;
    let why = match std::fs::metadata(&path).and_then(|found| Ok((found.len(), std::fs::read(&path)?))) {
        Ok((length, _)) if length > MOST_BYTES => format!("is larger than {} MiB", MOST_BYTES >> 20),
        Ok((_, text)) => format!("is no JSON: {}", serde_json::from_slice::<Value>(&text).err()?),
        Err(error) => format!("cannot be read: {error}"),
    };
    Some((path, why))
}

/// Why nothing can be shown of a folder that is meant as a store, from its name on.
pub(super) fn unshown(folder: &Path) -> String {
    let name = file_name(folder);
    if let Some((document, why)) = fault(folder) {
        return format!("{name}/{} {why}", file_name(&document));
    }
    if is_array(folder) {
        return format!("{name} is a plain Zarr array, which says nothing of axes and levels as OME-Zarr does");
    }
    match DOCUMENTS.into_iter().find(|document| folder.join(document).exists()) {
        Some(document) => format!("{name}/{document} names no image (no multiscales)"),
        None => format!("{name} is no store: it holds neither zarr.json nor .zattrs"),
    }
}

/// Whether a folder is meant as a store: by its name, or by what lies in it.
pub(super) fn is_meant_as_store(folder: &Path) -> bool {
    let is_called = folder.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("zarr"));
    is_called || says_something(folder)
}

/// Whether a folder has a document of Zarr.
pub(super) fn says_something(folder: &Path) -> bool {
    DOCUMENTS.iter().any(|document| folder.join(document).exists())
}

/// Whether a folder is an array of Zarr, whose folders are chunks.
pub(super) fn is_array(folder: &Path) -> bool {
    let says_so = || json(&folder.join("zarr.json")).is_some_and(|document| document["node_type"] == "array");
    folder.join(".zarray").exists() || says_so()
}

pub(super) fn json(path: &Path) -> Option<Value> {
    let is_short = std::fs::metadata(path).ok()?.len() <= MOST_BYTES;
    serde_json::from_slice(&std::fs::read(path).ok().filter(|_| is_short)?).ok()
}
