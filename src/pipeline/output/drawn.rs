//! The memory of surfaces that are drawn box by box: patches that wait to be welded, and the tables of all of them. How
//! large these get, only the surface tells: what goes beyond what was stated is held as it grows, and large patches are drawn
//! fewer at a time. That changes no bit: patches are welded in the order of their boxes.

use crate::error::Result;
use crate::exec::{Hold, Stage};

/// Boxes whose patches are made in parallel before they are welded, at most.
const BATCH: usize = 64;
/// What drawing holds is stated as so much: patches of [`BATCH`] boxes of 32^3 voxels that surfaces cross once or twice.
pub(crate) const STATED: u64 = 36 << 20;
/// A thread draws in buffers that take so many times what its patch does.
const BUFFERS: u64 = 2;
/// A table that is full is copied into one of twice its size; of several one at a time.
const TABLES: u64 = 2;

/// What was drawn so far.
pub(crate) struct Drawn<'s, 'a> {
    stage: &'s Stage<'a>,
    /// Bytes of the largest patch of the last batch.
    largest: u64,
    /// Bytes beyond what was stated, and their guard.
    more: u64,
    held: Option<Hold>,
    /// Whether there is no room for more than one box for each thread.
    is_tight: bool,
}

impl<'s, 'a> Drawn<'s, 'a> {
    /// Nothing.
    pub(crate) fn new(stage: &'s Stage<'a>) -> Self {
        Self { stage, largest: 0, more: 0, held: None, is_tight: false }
    }

    /// How many boxes are drawn next: as many as half of what was stated has room for, one for each thread at least.
    pub(crate) fn batch(&self) -> usize {
        let threads = self.stage.threads();
        match self.largest {
            _ if self.is_tight => threads,
            // Nothing is known of the surface yet.
            0 => (2 * threads).clamp(1, BATCH.max(threads)),
            largest => (STATED / 2 / largest).clamp(threads as u64, BATCH.max(threads) as u64) as usize,
        }
    }

    /// A batch was drawn whose patches take so many bytes each, and the tables of all so many; some boxes are left.
    ///
    /// # Errors
    /// When the next batch would not fit the memory.
    pub(crate) fn took(&mut self, patches: impl Iterator<Item = u64>, tables: u64, left: usize) -> Result<()> {
        // Surfaces end and begin again: what is forgotten is forgotten slowly.
        self.largest = patches.fold(self.largest / 2, u64::max).max(1);
        let drawing = self.stage.threads().min(left) as u64;
        let of = |waiting: usize, room: u64| {
            let patches = (waiting.min(left) as u64 + BUFFERS * drawing) * self.largest;
            (patches + TABLES * tables).saturating_sub(STATED) * room / 4
        };
        let [likely, least] = [of(self.batch(), 5), of(self.stage.threads(), 4)];
        if likely > self.more {
            self.held = None;
            self.more = likely;
            self.held = self.stage.hold(likely).ok();
            if self.held.is_none() {
                (self.is_tight, self.more) = (true, least);
                self.held = Some(self.stage.hold(least)?);
            }
        }
        Ok(())
    }
}
