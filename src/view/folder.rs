//! The files of a folder by the paths of requests: none outside of it, whatever the path, its encoding or links say, and no
//! listing.

use std::fs::{File, Metadata};
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use percent_encoding::percent_decode_str;

use crate::error::{Error, Result};

/// A folder whose files may be read.
#[derive(Clone, Debug)]
pub(super) struct Folder {
    /// Its true path: absolute, without links.
    root: PathBuf,
}

/// A file that was opened.
#[derive(Debug)]
pub(super) struct Opened {
    pub(super) file: File,
    pub(super) length: u64,
    /// Changes when the file does.
    pub(super) tag: String,
    pub(super) media_type: &'static str,
}

impl Folder {
    /// Opens a folder.
    ///
    /// # Errors
    /// When there is none, or it may not be read.
    pub(super) fn new(path: &Path) -> Result<Self> {
        let root =
            path.canonicalize().map_err(|e| Error::input(format!("cannot be opened: {e}")).caused_by(e).at(path))?;
        Ok(Self { root })
    }

    /// The file of a request's path; none where there is no such file in the folder.
    pub(super) fn open(&self, path: &str) -> Option<Opened> {
        let inside = relative(path)?;
        let file_path = self.root.join(inside).canonicalize().ok()?;
        if !file_path.starts_with(&self.root) {
            return None;
        }
        let file = File::open(&file_path).ok()?;
        let found = file.metadata().ok()?;
        // Reading a pipe or a device might never end.
        found.is_file().then(|| Opened {
            tag: tag(&found),
            length: found.len(),
            media_type: media_type(&file_path),
            file,
        })
    }

    pub(super) fn root(&self) -> &Path {
        &self.root
    }
}

/// A request's path as one below a folder; none where it has parts that lead elsewhere.
fn relative(path: &str) -> Option<PathBuf> {
    let decoded = percent_decode_str(path).decode_utf8().ok()?;
    let mut inside = PathBuf::new();
    for name in decoded.trim_start_matches('/').split('/') {
        let leads_away = matches!(name, "" | "." | "..") || name.contains(['\\', '\0']);
        if leads_away {
            return None;
        }
        inside.push(name);
    }
    // On some systems a name such as C: is a root of its own.
    inside.is_relative().then_some(inside)
}

fn tag(found: &Metadata) -> String {
    let changed = found.modified().ok().and_then(|time| time.duration_since(UNIX_EPOCH).ok()).unwrap_or_default();
    format!("\"{:x}-{:x}\"", found.len(), changed.as_nanos())
}

fn media_type(path: &Path) -> &'static str {
    match path.extension().and_then(|e| e.to_str()).unwrap_or_default() {
        "json" => "application/json",
        "html" => "text/html; charset=utf-8",
        "csv" | "txt" => "text/plain; charset=utf-8",
        "png" => "image/png",
        _ if path
            .file_name()
            .is_some_and(|name| [".zattrs", ".zarray", ".zgroup", ".zmetadata"].map(str::as_ref).contains(&name)) =>
        {
            "application/json"
        }
        _ => "application/octet-stream",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_outside_is_opened() {
        let outer = tempfile::tempdir().unwrap();
        let (inside, outside) = (outer.path().join("in"), outer.path().join("secret"));
        std::fs::create_dir(&inside).unwrap();
        std::fs::write(&outside, "secret").unwrap();
        std::fs::write(inside.join("a b.json"), "{}").unwrap();
        std::os::unix::fs::symlink(&outside, inside.join("link")).unwrap();
        std::os::unix::fs::symlink(outer.path(), inside.join("up")).unwrap();
        std::os::unix::fs::symlink(inside.join("a b.json"), inside.join("within")).unwrap();
        let folder = Folder::new(&inside).unwrap();
        for path in [
            "../secret",
            "/../secret",
            "%2e%2e/secret",
            "..%2fsecret",
            "link",
            "up/secret",
            "",
            "/",
            ".",
            "a b.json/",
            "a\0",
            "%00",
            "%ff",
            "..\\secret",
        ] {
            assert!(folder.open(path).is_none(), "{path:?}");
        }
        for path in ["a b.json", "/a%20b.json", "within"] {
            assert_eq!(folder.open(path).map(|opened| opened.length), Some(2), "{path:?}");
        }
    }

    #[test]
    fn a_file_that_changes_has_another_tag() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        std::fs::write(&path, "one").unwrap();
        let tag = || Folder::new(folder.path()).unwrap().open("a").unwrap().tag;
        let before = tag();
        assert_eq!(tag(), before);
        std::fs::write(&path, "four").unwrap();
        assert_ne!(tag(), before);
    }
}
