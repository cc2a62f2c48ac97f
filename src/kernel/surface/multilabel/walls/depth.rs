//! How deep a label goes behind its voxels at a wall: whether it is thick enough for wide Gaussians.
//!
//! Steps of half a width are made into the label, across the wall, until another one is met. A label that is four widths thick
//! counts as thick, one of two and a half not at all: what lies behind a wall is then seen through it by a few hundredths.

use std::cell::Cell;

use crate::grid::Box3;

/// Steps that are made, and those of them that are too few.
const STEPS: u8 = 7;
const THIN: u8 = 4;
/// What a thick label has.
pub(super) const FULL: u8 = STEPS - THIN;
const UNKNOWN: u8 = u8::MAX;

/// Depths of the voxels of a box, told when they are asked for.
#[derive(Clone, Debug, Default)]
pub(super) struct Depths {
    labels: Vec<u32>,
    around: Option<Box3>,
    known: Vec<Cell<u8>>,
    /// The labels of the box itself.
    own: Vec<u32>,
}

impl Depths {
    /// `labels` is dense over `around`.
    pub(super) fn enter(&mut self, labels: &[u32], around: &Box3, part: &Box3) {
        self.labels.clear();
        self.labels.extend_from_slice(labels);
        self.around = Some(*around);
        self.known.clear();
        self.known.resize(part.len(), Cell::new(UNKNOWN));
        around.cut(labels, part, &mut self.own);
    }

    /// Says that the voxels of the box that lie beyond a volume have no label; what lies behind walls stays as it was handed in.
    pub(super) fn clear_beyond(&mut self, volume: &Box3, part: &Box3) {
        if part.intersect(volume) == *part {
            return;
        }
        for (row, (y, z)) in self.own.chunks_exact_mut(part.shape()[0].max(1) as usize).zip(part.rows()) {
            for (label, x) in row.iter_mut().zip(part.lo[0]..) {
                *label = if volume.contains([x, y, z]) { *label } else { 0 };
            }
        }
    }

    /// The label at a place in the box.
    pub(super) fn label(&self, at: usize) -> u32 {
        self.own[at]
    }

    pub(super) fn bytes(&self) -> u64 {
        let of_labels = (self.labels.capacity() + self.own.capacity()) * size_of::<u32>();
        (of_labels + self.known.capacity()) as u64
    }

    /// From 0, of what is thin, to [`FULL`]: of a voxel and its place in the box, with the step across its wall into it.
    pub(super) fn of(&self, at: usize, voxel: [i64; 3], step: impl FnOnce() -> Option<[f64; 3]>) -> u8 {
        let known = &self.known[at];
        if known.get() == UNKNOWN {
            let steps = step().map_or(0, |step| self.steps(voxel, self.own[at], step));
            known.set(steps.saturating_sub(THIN));
        }
        known.get()
    }

    /// How many steps stay in the label.
    fn steps(&self, voxel: [i64; 3], label: u32, step: [f64; 3]) -> u8 {
        let Some(around) = self.around else { return 0 };
        let is_own = |n: &u8| {
            let place = std::array::from_fn(|a| voxel[a] + (f64::from(*n) * step[a]).round() as i64);
            around.contains(place) && self.labels[around.offset_of(place)] == label
        };
        (1..=STEPS).take_while(is_own).count() as u8
    }
}
