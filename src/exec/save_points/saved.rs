//! What a run finds of a stage that an earlier run had put by, on as many ranks as that had.

use std::fs::File;
use std::io::BufReader;
use std::path::PathBuf;

use serde::de::DeserializeOwned;

use crate::error::{Error, Result};
use crate::store::checkpoint::{Kept, KeptPart, restore, unpack};
use crate::store::{BrickArray, Element};

/// What a stage had put by: one part, or one of each rank that had worked on it.
pub struct Saved {
    kept: Kept,
    /// This rank, of how many.
    rank: usize,
    ranks: usize,
}

impl Saved {
    pub(super) fn new(kept: Kept, rank: usize, ranks: usize) -> Self {
        Self { kept, rank, ranks }
    }

    /// What all ranks knew alike.
    ///
    /// # Errors
    /// When that is something else.
    pub fn facts<F: DeserializeOwned>(&self) -> Result<F> {
        let first = self.kept.parts.first().ok_or_else(|| Error::failed("the checkpoint is empty"))?;
        facts(first)
    }

    /// What each rank knew of its own bricks, in order of these.
    ///
    /// # Errors
    /// When that is something else.
    pub fn facts_of_all<F: DeserializeOwned>(&self) -> Result<Vec<F>> {
        self.kept.parts.iter().map(facts).collect()
    }

    /// Whether all of it came from one rank, which can tell more than what ranks have in common.
    #[must_use]
    pub fn is_of_one(&self) -> bool {
        self.kept.parts.len() == 1
    }

    /// The same of this rank alone; none where it had put by nothing, or there were more or fewer ranks.
    #[must_use]
    pub fn of_this_rank(self) -> Option<Self> {
        let Self { kept, rank, ranks } = self;
        let part = kept.parts.into_iter().find(|part| (part.rank, part.ranks) == (rank, ranks))?;
        Some(Self { kept: Kept { parts: vec![part] }, rank, ranks })
    }

    /// The files of the output that were whole, as they are now, in the order in which the stage named them.
    #[must_use]
    pub fn linked(&self) -> Vec<&PathBuf> {
        self.kept.parts.iter().flat_map(|part| &part.links).collect()
    }

    /// Puts the bricks of its `n`-th field that this rank owns back.
    ///
    /// # Errors
    /// When they cannot be read, or are those of another field.
    pub fn restore<T: Element>(&self, n: usize, field: &BrickArray<T>) -> Result<()> {
        let mut sums = [0; 2];
        // What all ranks had alike one of them has put by.
        let files: Vec<&PathBuf> = self.kept.parts.iter().filter_map(|part| part.files.get(n)).collect();
        for &path in &files {
            let read = || restore(field, &mut BufReader::with_capacity(1 << 20, File::open(path)?));
            let counts = read().map_err(|error| {
                Error::from_io("the checkpoint cannot be read; leave --resume out to begin anew", &error).at(path)
            })?;
            sums = [sums[0] + counts[0], sums[1] + counts[1]];
        }
        if files.is_empty() {
            return Err(Error::failed("the checkpoint has too few fields"));
        }
        if self.ranks == 1 && sums[0] != sums[1] {
            return Err(Error::failed(
                "the checkpoint names bricks that the field has not; leave --resume out to begin anew",
            ));
        }
        Ok(())
    }
}

fn facts<F: DeserializeOwned>(part: &KeptPart) -> Result<F> {
    unpack(&part.facts).map_err(|error| {
        Error::from_io("the checkpoint cannot be understood; leave --resume out to begin anew", &error)
    })
}
