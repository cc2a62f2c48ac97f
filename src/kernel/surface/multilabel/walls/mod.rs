//! Smooth walls between the labels of a volume that touch: where between two voxels the wall lies, told from smoothed indicator
//! functions of the labels (`smoothed`), on the scale that the labels' thickness allows (`depth`).
//!
//! Let n and w be the indicator of a label under Gaussians of the widths s and 2 s. What 2 n - w is for one label and for the
//! other are equal on the wall: on a flat one for any weights, and with these, by which the widths cancel, a curved one is off
//! by the fourth power of the width only, where n alone would have moved it inward by s^2 / R. It is smooth because terraces
//! of voxels are narrower than the Gaussians.
//!
//! Where a third label is near, each has the part of its angle at the line where all meet, under Gaussians of any width; the one
//! with the largest would advance. So there the wall is where either label ends, which is where its own 2 n - w is a half: by
//! the second label's as much as the first one's part falls short of a half, and the other way round. At the line the two cancel,
//! whatever the angles are; along the plane against which two others lie, it alone is asked, and goes on as if these were one.
//!
//! A plate less than four widths thick would bulge, as 2 n - w of its far side is seen through it. There, and near third labels,
//! half that width is taken.
//!
//! The wall never passes a voxel's centre: it stays within half a voxel of the faces between voxels.
//!
//! Where a volume ends nothing is known of what lies beyond. Walls are told there as if it went on as it ends, and run straight
//! into the end; what is closed there is cut off flat.

pub(crate) mod depth;
pub(crate) mod smoothed;

use depth::{Depths, FULL};
use smoothed::{Scales, Smoothed};

use super::sides::Sides;
use crate::grid::Box3;

/// What 2 n - w grows by in one width s across a flat wall: 2 / sqrt(2 pi) - 1 / (2 sqrt(2 pi)).
const SLOPE: f64 = 0.598_413_42;
/// With so much of other labels the wider Gaussians have no say, and labels are weighed in full.
const THIRDS: f64 = 0.2;

/// The walls in one box; keeps its working memory between boxes.
#[derive(Clone, Debug)]
pub struct Walls {
    smoothed: Smoothed,
    depths: Depths,
    part: Box3,
    /// The voxels beyond which there is no label.
    ends: Option<Box3>,
}

/// What two labels are at one place, under the three Gaussians.
type Seen = [[f64; 2]; 3];

impl Walls {
    /// For voxels of some spacing.
    #[must_use]
    pub fn new(spacing: [f64; 3]) -> Self {
        let smoothed = Smoothed::new(Scales::new(spacing));
        Self { smoothed, depths: Depths::default(), part: Box3::from_shape([0; 3]), ends: None }
    }

    /// For labels that are closed where their volume ends. What is handed in beyond that is to be as the nearest voxels within.
    #[must_use]
    pub fn closed(spacing: [f64; 3], volume: Box3) -> Self {
        Self { ends: Some(volume), ..Self::new(spacing) }
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
        if let Some(ends) = &self.ends {
            self.depths.clear_beyond(ends, part);
        }
    }

    fn is_one(&self) -> bool {
        self.smoothed.is_one() && self.ends.is_none_or(|ends| self.part.intersect(&ends) == self.part)
    }

    fn label(&self, at: usize) -> u32 {
        self.depths.label(at)
    }

    fn between(&self, ends: [[i64; 3]; 2], labels: [u32; 2]) -> f64 {
        if self.ends.is_some_and(|within| ends.iter().any(|voxel| !within.contains(*voxel))) {
            return 0.5;
        }
        let depth = [0, 1].map(|n| {
            let smoothed = &self.smoothed;
            self.depths.of(self.part.offset_of(ends[n]), ends[n], || smoothed.inward(labels[n], ends[n]))
        });
        let coarse = f64::from(depth[0].min(depth[1])) / f64::from(FULL);
        Self::equal(ends.map(|voxel| self.smoothed.seen(labels, voxel)), coarse)
    }

    fn ends(&self) -> Option<&Box3> {
        self.ends.as_ref()
    }

    fn bytes(&self) -> u64 {
        self.smoothed.bytes() + self.depths.bytes()
    }
}

/// How far a place lies on the side of the first label, in narrow widths where the wall is flat; `coarse` is how far the thickness of
/// both allows the wider Gaussians.
fn lead(seen: &Seen, coarse: f64) -> f64 {
    let [fine, middle, wide] = seen;
    let narrow = by_both(fine, middle);
    narrow + coarse * (1.0 - thirds(middle)) * (2.0 * by_both(middle, wide) - narrow)
}

/// The same by a Gaussian n and one twice as wide, w: what 2 n - w of either label says of its own end, where it is a half, each as
/// much as the other one falls short of a half.
fn by_both(narrow: &[f64; 2], wide: &[f64; 2]) -> f64 {
    let beyond = |n: usize| 2.0 * narrow[n] - wide[n] - 0.5;
    let short = [0, 1].map(|n: usize| (0.5 - wide[n]).max(0.0));
    let all = short[0] + short[1];
    // Where there is little of others, which of the two is nearer to a half is a matter of voxels.
    let uneven = if all > 0.0 { thirds(wide) * (short[1] / all - 0.5) } else { 0.0 };
    ((0.5 + uneven) * beyond(0) - (0.5 - uneven) * beyond(1)) / SLOPE
}

/// How much there is of other labels, as a part of what counts in full.
fn thirds(seen: &[f64; 2]) -> f64 {
    ((1.0 - seen[0] - seen[1]) / THIRDS).clamp(0.0, 1.0)
}
