//! Whether what is shown is still there, and still the same: folders by their numbers on the disk, not by their names.

use std::fs::Metadata;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

/// A store or mesh that is there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Present {
    /// Its name on the server.
    pub(super) name: String,
    /// Another where another one lies in its place.
    pub(super) number: u64,
    /// When what says what it holds was written; a store may lose that before the rest.
    described: [Option<SystemTime>; 2],
}

/// The store or file of that name, where it is there.
pub(super) fn present(name: &str, path: &Path) -> Option<Present> {
    let found = std::fs::metadata(path).ok()?;
    let mut hasher = DefaultHasher::new();
    identity(&found).hash(&mut hasher);
    if found.is_file() {
        (found.len(), found.modified().ok()).hash(&mut hasher);
    }
    let described = ["zarr.json", ".zattrs"].map(|document| path.join(document).metadata().ok()?.modified().ok());
    Some(Present { name: name.to_owned(), number: hasher.finish(), described })
}

/// What tells a folder or file from another of its name: numbers are given again, so the time at which it was made counts too.
fn identity(found: &Metadata) -> ([u64; 2], u128) {
    let since = found.created().ok().and_then(|at| at.duration_since(UNIX_EPOCH).ok()).unwrap_or_default();
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        ([found.dev(), found.ino()], since.as_nanos())
    }
    #[cfg(not(unix))]
    {
        ([0; 2], since.as_nanos())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_is_moved_is_the_same_and_one_made_again_is_not() {
        let outer = tempfile::tempdir().unwrap();
        let (store, away) = (outer.path().join("a.zarr"), outer.path().join("away"));
        let make = || {
            std::fs::create_dir(&store).unwrap();
            std::fs::write(store.join("zarr.json"), "{}").unwrap();
        };
        make();
        let first = present("a", &store).unwrap();
        std::fs::write(store.join("report.json"), "{}").unwrap();
        assert_eq!(present("a", &store), Some(first.clone()), "a file more");
        std::fs::rename(&store, &away).unwrap();
        assert_eq!(present("a", &store), None);
        make();
        assert_ne!(present("a", &store).unwrap().number, first.number);
        std::fs::remove_dir_all(&store).unwrap();
        std::fs::rename(&away, &store).unwrap();
        assert_eq!(present("a", &store), Some(first.clone()));
        std::fs::remove_file(store.join("zarr.json")).unwrap();
        assert_ne!(present("a", &store), Some(first), "it says nothing any more");
    }
}
