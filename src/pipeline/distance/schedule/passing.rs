//! What a front has passed: bricks whose values nothing that is still under way can lower, so that they can be read out before
//! the front is over (docs/algorithms.md, "The front schedule").
//!
//! What enters a brick from now on is at least `nearest`, the smallest of all values under way. A brick that a value `a` once
//! entered holds a voxel of at most `a`, and since a distance grows by no more than the way, none of more than `a` and the
//! brick's diagonal. So it is passed once `nearest` is larger. Computed distances grow by a fraction of a spacing more here and
//! there, and a method that keeps sources may, next to never, find one late; hence a margin, as wide as a brick, and if a brick
//! that was told as passed changes all the same, that is told.

use crate::error::Result;
use crate::grid::{Box3, BrickSet, Slot};

/// Who wants to know what a front has passed. Asked between rounds, when nothing changes.
pub trait Watch: Sync {
    /// The front has come farther.
    ///
    /// # Errors
    /// When what is done with it fails; the run ends.
    fn passed(&self, passed: &Passed<'_>) -> Result<()>;

    /// A brick that was passed has changed.
    fn reopened(&self);
}

/// Bricks that the front has passed.
pub struct Passed<'a> {
    set: &'a BrickSet,
    first: &'a [f64],
    limit: f64,
}

impl Passed<'_> {
    /// Whether all of a box was passed.
    #[must_use]
    pub fn holds(&self, part: &Box3) -> bool {
        let passed = |id| self.set.slot(id).is_some_and(|slot| self.first[slot as usize] <= self.limit);
        self.set.grid().bricks_in(part).all(passed)
    }
}

/// Keeps account of what was passed.
pub(crate) struct Passing<'a> {
    watch: &'a dyn Watch,
    /// The smallest value that ever entered each brick.
    first: Vec<f64>,
    /// How far behind the nearest value a first one must lie.
    lag: f64,
    /// What was told: bricks whose first value is no larger.
    limit: f64,
}

impl<'a> Passing<'a> {
    pub(crate) fn new(watch: &'a dyn Watch, set: &BrickSet, spacing: [f64; 3]) -> Self {
        let edge = set.grid().edge() as f64;
        // The diagonals of a brick and of a cell, in whose corners the values lie that sources fix; the margin.
        let cell = spacing.iter().map(|h| h * h).sum::<f64>().sqrt();
        let longest = spacing.iter().copied().fold(0.0, f64::max);
        let lag = (edge + 1.0) * cell + edge * longest;
        Self { watch, first: vec![f64::INFINITY; set.len()], lag, limit: f64::NEG_INFINITY }
    }

    /// A brick was visited that a value had entered, and perhaps changed.
    pub(crate) fn visited(&mut self, slot: Slot, arrival: f64, changed: bool) {
        let first = &mut self.first[slot as usize];
        if changed && *first <= self.limit {
            self.watch.reopened();
        }
        *first = first.min(arrival);
    }

    /// Nothing smaller than `nearest` is under way.
    pub(crate) fn reach(&mut self, set: &BrickSet, nearest: f64) -> Result<()> {
        let limit = nearest - self.lag;
        if limit < 0.0 || limit <= self.limit {
            return Ok(());
        }
        self.limit = limit;
        self.watch.passed(&Passed { set, first: &self.first, limit })
    }
}
