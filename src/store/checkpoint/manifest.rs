//! What a checkpoint tells: who made it, and of each stage what it knows and which files are its.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::identity::Identity;
use super::links::LinkOf;
use super::names::Owner;

/// A checkpoint of one rank; a run on one rank alone has no others.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Manifest {
    pub(super) identity: Identity,
    /// The rank that took it, of how many.
    pub(super) rank: usize,
    pub(super) ranks: usize,
    /// The run that took it had gone on from what has numbers up to this one.
    pub(super) since: u64,
    /// How many all ranks of the run had taken together.
    pub(super) together: u64,
    /// By stage.
    pub(super) entries: BTreeMap<String, Held>,
}

/// What is known of a stage: what this rank has put by, or what all ranks of an earlier run had.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Held {
    pub(super) parts: Vec<Entry>,
    pub(super) is_own: bool,
}

impl Held {
    pub(super) fn own(entry: Entry) -> Self {
        Self { parts: vec![entry], is_own: true }
    }
}

/// What a rank has put by of a stage.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Entry {
    pub(super) rank: usize,
    pub(super) ranks: usize,
    /// What it knows, packed.
    pub(super) facts: Vec<u8>,
    pub(super) files: Vec<FileOf>,
    pub(super) links: Vec<LinkOf>,
}

impl Entry {
    /// The names of its files.
    pub(super) fn names(&self) -> impl Iterator<Item = &String> {
        self.files.iter().map(|file| &file.name).chain(self.links.iter().map(|link| &link.name))
    }
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct FileOf {
    pub(super) name: String,
    pub(super) bytes: u64,
}

impl Manifest {
    /// Whose it is.
    pub(super) fn owner(&self) -> Owner {
        Owner::new(self.rank, self.ranks)
    }

    fn parts(&self) -> impl Iterator<Item = &Entry> {
        self.entries.values().flat_map(|held| &held.parts)
    }

    /// The fields that it names.
    pub(super) fn files(&self) -> impl Iterator<Item = &FileOf> {
        self.parts().flat_map(|entry| &entry.files)
    }

    /// The names of all that it needs.
    pub(super) fn needed(&self) -> BTreeSet<String> {
        self.parts().flat_map(Entry::names).cloned().collect()
    }
}

/// What the ranks of a run have put by, each of its own: what one of them has of a stage counts more than what an earlier run had.
pub(super) fn joined(manifests: Vec<Manifest>) -> BTreeMap<String, Held> {
    let mut all: BTreeMap<String, Held> = BTreeMap::new();
    for (key, held) in manifests.into_iter().flat_map(|manifest| manifest.entries) {
        match all.get_mut(&key) {
            Some(there) if there.is_own && held.is_own => there.parts.extend(held.parts),
            Some(there) if there.is_own || !held.is_own => {}
            _ => _ = all.insert(key, held),
        }
    }
    for held in all.values_mut() {
        held.is_own = false;
    }
    all
}
