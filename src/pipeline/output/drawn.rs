//! The memory of surfaces that are drawn box by box: patches that wait to be welded, the buffers they are made in, and the
//! tables of all of them. How large these get, only the surface tells: what goes beyond what was stated is held before the next
//! boxes are drawn, and of those as few at a time as there is room for. That changes no bit: patches are welded in the order of
//! their boxes.

use crate::error::Result;
use crate::exec::{Hold, Stage};
use crate::kernel::surface::Growing;

/// Boxes whose patches are made in parallel before they are welded, at most.
const BATCH: usize = 64;
/// What drawing holds is stated as so much at least: patches of [`BATCH`] boxes of 32^3 voxels that surfaces cross once or twice.
pub(crate) const STATED: u64 = 36 << 20;
/// As long as nothing is known of the surface, so many boxes are drawn at a time: what they take fits what was stated.
const FIRST: usize = 4;
/// The next patches may be larger than those so far by a part of one over that, where there is room.
const RESERVE: u64 = 4;

/// Boxes that were drawn at the same time, and what is held after that. Bytes.
pub(crate) struct Wave<'w> {
    /// Of each box's patch.
    pub(crate) patches: &'w [u64],
    /// Of each set of buffers.
    pub(crate) buffers: &'w [u64],
    /// Of what is known of the patch that was welded last.
    pub(crate) last: u64,
    /// What the whole surface has.
    pub(crate) tables: &'w [Growing],
    /// Boxes that are not drawn yet.
    pub(crate) left: usize,
}

/// What was drawn so far.
pub(crate) struct Drawn<'s, 'a> {
    stage: &'s Stage<'a>,
    /// Bytes that were stated.
    stated: u64,
    /// Boxes that a surface crosses, bytes of their patches, of the largest one, and of the largest set of buffers.
    crossed: usize,
    sum: u64,
    largest: u64,
    buffers: u64,
    /// Boxes that are drawn next.
    next: usize,
    /// Bytes beyond what was stated, and their guard.
    more: u64,
    held: Option<Hold>,
}

impl<'s, 'a> Drawn<'s, 'a> {
    /// Nothing, where so many bytes were stated.
    pub(crate) fn new(stage: &'s Stage<'a>, stated: u64) -> Self {
        Self { stage, stated, crossed: 0, sum: 0, largest: 0, buffers: 0, next: FIRST, more: 0, held: None }
    }

    /// How many boxes are drawn next.
    pub(crate) fn next(&self) -> usize {
        self.next
    }

    /// Some boxes were drawn: makes room for the next ones.
    ///
    /// # Errors
    /// When not even one more would fit the memory.
    pub(crate) fn took(&mut self, wave: &Wave<'_>) -> Result<()> {
        self.crossed += wave.patches.iter().filter(|&&bytes| bytes > 0).count();
        self.sum += wave.patches.iter().sum::<u64>();
        self.largest = wave.patches.iter().copied().fold(self.largest, u64::max);
        self.buffers = wave.buffers.iter().copied().fold(self.buffers, u64::max);
        if wave.left == 0 {
            return Ok(());
        }
        self.next = self.wished().min(wave.left);
        loop {
            let room = self.room(wave, self.next);
            let more = (room + if self.next > 1 { room / RESERVE } else { 0 }).saturating_sub(self.stated);
            if more <= self.more {
                return Ok(());
            }
            (self.held, self.more) = (None, 0);
            match self.stage.hold(more) {
                Ok(held) => {
                    (self.held, self.more) = (Some(held), more);
                    return Ok(());
                }
                Err(error) if self.next == 1 => return Err(error),
                Err(_) => self.next /= 2,
            }
        }
    }

    /// As many boxes as half of what was stated has room for, two for each thread at least; not many more than surfaces were
    /// seen in, for the next may be the first ones that are crossed.
    fn wished(&self) -> usize {
        let least = 2 * self.stage.threads();
        let fit = (self.stated / 2).checked_div(self.largest).map_or(BATCH, |fit| fit.min(BATCH as u64) as usize);
        fit.max(least).min(FIRST.max(2 * self.crossed))
    }

    /// Bytes that are held while so many more boxes are drawn and welded.
    fn room(&self, wave: &Wave<'_>, boxes: usize) -> u64 {
        let drawing = boxes.min(self.stage.threads());
        // Patches that wait are as large as what is in them; those that are made take up to twice that.
        let patches = (boxes + drawing) as u64 * self.largest;
        let buffers = wave.buffers.len().max(drawing) as u64 * self.buffers;
        // At most the whole surface grows as much as the patches do: most tables forget what lies below.
        let times = 1.0 + (boxes as u64 * self.largest) as f64 / self.sum.max(1) as f64;
        patches + buffers + wave.last + Growing::on_the_way(wave.tables, times)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exec::{Budget, Cancel, Engine, Silent};
    use crate::store::Scratch;
    use std::sync::Arc;

    const MIB: u64 = 1 << 20;
    /// The program itself and the window that a run under way goes on with.
    const BESIDE: u64 = 80 * MIB;

    /// How many boxes are drawn next, and what is held for them beyond what was stated, in MiB, where so much may be; or the
    /// refusal. Four boxes were drawn in three threads, their patches of so many MiB.
    fn next(patches: [u64; 4], allowed: u64) -> Result<(usize, u64)> {
        let folder = tempfile::tempdir().unwrap();
        let (scratch, budget) = (Scratch::new(folder.path(), 1 << 40), Budget { total: BESIDE + allowed * MIB });
        let engine = Engine::new(3, scratch.clone(), budget, Cancel::default(), Arc::new(Silent)).unwrap();
        let stage = engine.stage("surface", 0);
        let mut drawn = Drawn::new(&stage, STATED);
        assert_eq!(drawn.next(), 4);
        let [patches, buffers] = [patches, [4, 4, 0, 0]].map(|all| all.map(|n| n * MIB));
        drawn.took(&Wave { patches: &patches, buffers: &buffers[..2], last: 0, tables: &[], left: 100 })?;
        let held = if drawn.held.is_some() { budget.total - 48 * MIB - scratch.window() } else { 0 };
        Ok((drawn.next(), held / MIB))
    }

    #[test]
    fn as_many_boxes_are_drawn_as_there_is_room_for() {
        // Six patches that wait and three that are made, at 8 MiB, three sets of buffers, and a quarter more: less 36 MiB.
        assert_eq!(next([1, 8, 2, 0], 100).unwrap(), (6, 105 - 36));
        assert_eq!(next([1, 8, 2, 0], 69).unwrap(), (6, 69));
        assert_eq!(next([1, 8, 2, 0], 68).unwrap(), (3, 75 - 36));
        assert_eq!(next([1, 8, 2, 0], 38).unwrap(), (1, 0), "this is within what was stated");
        assert_eq!(next([0; 4], 0).unwrap(), (4, 0), "the surface may begin in the next box");
        let error = next([90, 0, 0, 0], 100).unwrap_err().to_string();
        // One patch that waits, is made, and two sets of buffers, which were there; 48 and 64 MiB beside them.
        assert!(error.contains("give at least --memory 264MiB"), "{error}");
    }
}
