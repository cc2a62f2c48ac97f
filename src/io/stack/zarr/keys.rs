//! The names of chunks as they lie on the disk, held against those that the metadata make.
//!
//! A chunk that is not there is one of fill values (Zarr 2 and 3). So an array whose files are named in another way than
//! its metadata say, as writers before `dimension_separator` (Zarr 2, 2021) left them, or that was copied without its
//! chunks, would read as empty and be no error.

use std::fs;
use std::path::{Path, PathBuf};

/// Files that are looked at, at most, for one with the name of a chunk.
const MOST_LOOKED_AT: usize = 1 << 12;

/// How the chunks of an array are named.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Keys {
    /// As the metadata say, as far as was looked.
    AsTold,
    /// Numbers with this between them, and nothing before, in place of what the metadata say.
    Separated(char),
    /// There is no chunk.
    Nothing,
    /// In another way, such as this.
    Foreign(String),
}

impl Keys {
    /// Looks at the files in an array's folder; `told` is the name that its metadata make of a place.
    pub(crate) fn of(folder: &Path, axes: usize, told: impl Fn(&[u64]) -> String) -> Self {
        let mut due = vec![PathBuf::new()];
        let (mut other, mut looked_at) = (None, 0);
        while let Some(below) = due.pop() {
            for entry in fs::read_dir(folder.join(&below)).into_iter().flatten().flatten() {
                looked_at += 1;
                let name = entry.file_name().to_string_lossy().into_owned();
                let path = below.join(&name);
                let key =
                    path.components().map(|part| part.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/");
                let Some(at) = numbers(&key) else { continue };
                if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
                    due.push(path);
                } else if at.len() == axes.max(1) {
                    if told(&at) == key {
                        return Self::AsTold;
                    }
                    other.get_or_insert(key);
                }
            }
            if looked_at > MOST_LOOKED_AT {
                return other.map_or(Self::AsTold, Self::named);
            }
        }
        other.map_or(Self::Nothing, Self::named)
    }

    /// What the name of a chunk that the metadata do not make is one of.
    fn named(key: String) -> Self {
        let plain = |separator: char| key.split(separator).all(|part| part.parse::<u64>().is_ok());
        match ['/', '.'].into_iter().find(|&separator| key.contains(separator) && plain(separator)) {
            Some(separator) => Self::Separated(separator),
            None => Self::Foreign(key),
        }
    }

    /// The name of a chunk, where it is not the one that the metadata make.
    pub(crate) fn name(&self, at: &[u64]) -> Option<String> {
        let Self::Separated(separator) = self else { return None };
        Some(at.iter().map(u64::to_string).collect::<Vec<_>>().join(&separator.to_string()))
    }
}

/// The numbers in the name of a chunk, or of a folder of chunks; none for other names.
fn numbers(key: &str) -> Option<Vec<u64>> {
    let key = key.strip_prefix('c').unwrap_or(key);
    key.split(['/', '.']).filter(|part| !part.is_empty()).map(|part| part.parse().ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_on_the_disk_are_told_from_those_of_the_metadata() {
        let joined = |separator: &'static str| {
            move |at: &[u64]| at.iter().map(u64::to_string).collect::<Vec<_>>().join(separator)
        };
        for (file, keys_with_dots, keys_with_slashes) in [
            ("0.1.2", Keys::AsTold, Keys::Separated('.')),
            ("0/1/2", Keys::Separated('/'), Keys::AsTold),
            ("c/0/1/2", Keys::Foreign("c/0/1/2".into()), Keys::Foreign("c/0/1/2".into())),
            ("c.0.1.2", Keys::Foreign("c.0.1.2".into()), Keys::Foreign("c.0.1.2".into())),
            ("notes.txt", Keys::Nothing, Keys::Nothing),
            (".zarray", Keys::Nothing, Keys::Nothing),
        ] {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(&path, b"").unwrap();
            assert_eq!(Keys::of(folder.path(), 3, joined(".")), keys_with_dots, "{file}");
            assert_eq!(Keys::of(folder.path(), 3, joined("/")), keys_with_slashes, "{file}");
        }
        assert_eq!(Keys::Separated('/').name(&[3, 0, 12]).as_deref(), Some("3/0/12"));
        assert_eq!(Keys::AsTold.name(&[3]), None);
    }
}
