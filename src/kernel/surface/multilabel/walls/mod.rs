//! Smooth walls between the labels of a volume that touch: where between two voxels the wall lies, told from smoothed indicator
//! functions of the labels (`smoothed`), on the scale that the labels' thickness allows (`depth`).
//!
//! Let n and w be the indicator of a label under Gaussians of the widths s and 2 s. What 2 n - w is for one label and for the
//! other are equal on the wall: on a flat one for any weights, and with these, by which the widths cancel, a curved one is off
//! by the fourth power of the width only, where n alone would have moved it inward by s^2 / R. It is smooth because terraces
//! of voxels are narrower than the Gaussians.
//!
//! Two things ask for half that width. A plate less than four widths thick would bulge, as 2 n - w of its far side is seen through it; and
//! where a third label is near, each has the part of its angle at the line where all meet, so that the largest would
//! advance. There two labels are equal where what the narrow Gaussian sees of them, over what the wide one does, is the same: at
//! the line these parts are those of its angles for both. Between one rule and the other they are mixed.
//!
//! The wall never passes a voxel's centre: it stays within half a voxel of the faces between voxels.

pub(crate) mod depth;
pub(crate) mod smoothed;

use depth::{Depths, FULL};
use smoothed::{Scales, Smoothed};

use super::sides::Sides;
use crate::grid::Box3;

/// What 2 n - w grows by in one width s across a flat wall: 2 / sqrt(2 pi) - 1 / (2 sqrt(2 pi)).
const SLOPE: f64 = 0.598_413_42;
/// The same of the logarithm of n / w, of one label less the other's.
const EXCESS_SLOPE: f64 = 0.85;
/// With so much of other labels two are told apart by their excess alone.
const THIRDS: f64 = 0.2;
/// Less of a label is not told from nothing.
const LEAST: f64 = 1e-4;

/// The walls in one box; keeps its working memory between boxes.
#[derive(Clone, Debug)]
pub struct Walls {
    smoothed: Smoothed,
    depths: Depths,
    part: Box3,
}

/// What two labels are at one place, under the three Gaussians.
type Seen = [[f64; 2]; 3];

impl Walls {
    /// For voxels of some spacing.
    #[must_use]
    pub fn new(spacing: [f64; 3]) -> Self {
        let smoothed = Smoothed::new(Scales::new(spacing));
        Self { smoothed, depths: Depths::default(), part: Box3::from_shape([0; 3]) }
    }

    /// How many voxels around a box are looked at, along each axis.
    #[must_use]
    pub fn reach(spacing: [f64; 3]) -> [i64; 3] {
        Scales::new(spacing).reach().map(|radius| radius + 1)
    }

    /// The part of the way from one label to the other, seen at both ends, at which they are equal.
    fn equal(seen: [Seen; 2], coarse: f64) -> f64 {
        let [from, to] = seen.map(|seen| lead(&seen, coarse));
        if from > to { from / (from - to) } else { 0.5 }
    }
}

impl Sides for Walls {
    fn enter(&mut self, labels: &[u32], around: &Box3, part: &Box3) {
        self.part = *part;
        self.smoothed.enter(labels, around, part);
        self.depths.enter(labels, around, part);
    }

    fn is_one(&self) -> bool {
        self.smoothed.is_one()
    }

    fn label(&self, at: usize) -> u32 {
        self.depths.label(at)
    }

    fn between(&self, ends: [[i64; 3]; 2], labels: [u32; 2]) -> f64 {
        let depth = [0, 1].map(|n| {
            let smoothed = &self.smoothed;
            self.depths.of(self.part.offset_of(ends[n]), ends[n], || smoothed.inward(labels[n], ends[n]))
        });
        let coarse = f64::from(depth[0].min(depth[1])) / f64::from(FULL);
        Self::equal(ends.map(|voxel| self.smoothed.seen(labels, voxel)), coarse)
    }

    fn bytes(&self) -> u64 {
        self.smoothed.bytes() + self.depths.bytes()
    }
}

/// How far a place lies on the side of the first label, in narrow widths where the wall is flat; `coarse` is how far the thickness of
/// both allows the wider Gaussians.
fn lead(seen: &Seen, coarse: f64) -> f64 {
    let [fine, middle, wide] = seen;
    let thirds = |seen: &[f64; 2]| ((1.0 - seen[0] - seen[1]) / THIRDS).clamp(0.0, 1.0);
    let smooth = |narrow: &[f64; 2], wide: &[f64; 2]| {
        let excess = |n: usize| 2.0 * narrow[n] - wide[n];
        (excess(0) - excess(1)) / (2.0 * SLOPE)
    };
    let ratio = |n: usize| libm::log(fine[n].max(LEAST) / middle[n].max(LEAST));
    let coarse = coarse * (1.0 - thirds(middle));
    let near_others = thirds(fine);
    let by_part = if near_others > 0.0 { (ratio(0) - ratio(1)) / EXCESS_SLOPE } else { 0.0 };
    let plain = smooth(fine, middle);
    let fine = plain + near_others * (by_part - plain);
    fine + coarse * (2.0 * smooth(middle, wide) - fine)
}
