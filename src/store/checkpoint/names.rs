//! What files of checkpoints are called. What has another name in their folder is somebody's own, and stays.
//!
//! Of a run on several ranks each has files of its own, which name it: `000007-r3.checkpoint`, `000006-r3-0.bricks`.

use std::fs;
use std::path::Path;

/// How the names of manifests end.
const MANIFEST: &str = ".checkpoint";
/// Those of fields, and of files of the output.
const FIELD: &str = ".bricks";
const LINK: &str = ".shard";
/// Digits of a number, at least.
const DIGITS: usize = 6;

/// Whose files: those of a rank, or of a run on one rank alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Owner(pub(super) Option<usize>);

impl Owner {
    /// A rank of so many.
    pub(super) fn new(rank: usize, ranks: usize) -> Self {
        Self((ranks > 1).then_some(rank))
    }

    fn stem(self, number: u64) -> String {
        match self.0 {
            None => format!("{number:0DIGITS$}"),
            Some(rank) => format!("{number:0DIGITS$}-r{rank}"),
        }
    }
}

pub(super) fn manifest_name(owner: Owner, number: u64) -> String {
    format!("{}{MANIFEST}", owner.stem(number))
}

/// The `n`-th field of a checkpoint.
pub(super) fn field_name(owner: Owner, number: u64, n: usize) -> String {
    format!("{}-{n}{FIELD}", owner.stem(number))
}

/// The `n`-th file of the output, which came with that checkpoint.
pub(super) fn link_name(owner: Owner, number: u64, n: usize) -> String {
    format!("{}-{n}{LINK}", owner.stem(number))
}

/// The numbers of the manifests in a folder and whose they are, ascending.
pub(super) fn manifests(folder: &Path) -> Vec<(u64, Owner)> {
    let names = names(folder);
    let mut found: Vec<_> =
        names.iter().filter(|name| name.ends_with(MANIFEST)).filter_map(|name| number_and_owner(name)).collect();
    found.sort_unstable();
    found
}

/// The names in a folder that are those of checkpoints.
pub(super) fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let files = entries.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_file()));
    files
        .filter_map(|entry| entry.file_name().into_string().ok())
        .filter(|name| number_and_owner(name).is_some())
        .collect()
}

/// The number in a name and whose it is; none where it is somebody's own.
pub(super) fn number_and_owner(name: &str) -> Option<(u64, Owner)> {
    let is_number = |digits: &str| !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    let stem = if let Some(stem) = name.strip_suffix(MANIFEST) {
        stem
    } else {
        let stem = name.strip_suffix(FIELD).or_else(|| name.strip_suffix(LINK))?;
        let (stem, _) = stem.rsplit_once('-').filter(|(_, n)| is_number(n))?;
        stem
    };
    let (number, rank) = match stem.split_once("-r") {
        Some((number, rank)) => (number, Some(rank).filter(|rank| is_number(rank))?.parse().map(Some).ok()?),
        None => (stem, None),
    };
    let is_long = number.len() >= DIGITS && is_number(number);
    Some((number.parse().ok().filter(|_| is_long)?, Owner(rank)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_tell_whose_they_are() {
        for owner in [Owner(None), Owner(Some(0)), Owner(Some(13))] {
            let names = [manifest_name(owner, 7), field_name(owner, 7, 2), link_name(owner, 7, 30)];
            assert!(names.iter().all(|name| number_and_owner(name) == Some((7, owner))), "{names:?}");
        }
        for name in
            ["mine.txt", "2024-11-05.bricks", "12-3.shard", "000001-r.checkpoint", "000001-r1x-0.bricks", "lock"]
        {
            assert_eq!(number_and_owner(name), None, "{name}");
        }
    }
}
