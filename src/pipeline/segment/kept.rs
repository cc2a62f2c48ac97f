//! What a segmentation leaves with who asked for it: the segmentation function of each object, and the label volume.

use std::sync::Arc;

use super::neighbours::Joined;
use super::object_report::ObjectReport;
use super::ranks::solved::Solved;
use crate::error::Result;
use crate::exec::{Engine, Workers};
use crate::grid::{Box3, BrickGrid, BrickSet, Geometry, Slot};
use crate::store::{BoxSource, BrickArray};

/// Edge of the bricks of the label volume.
const EDGE: i64 = 64;

/// What is kept.
pub struct Kept {
    /// The objects, in order of their labels.
    pub objects: Vec<KeptObject>,
    /// The labels on the grid of the image; bricks without any are not stored.
    pub labels: BrickArray<u32>,
}

/// An object that was solved.
pub struct KeptObject {
    /// Its label.
    pub label: u32,
    /// The grid of its box.
    pub geometry: Geometry,
    /// Its segmentation function there: 1 inside, 0 outside, the surface at 1/2.
    pub u: BrickArray<f32>,
}

/// Bytes of the label volume's bricks that a box of the grid meets.
pub(super) fn label_bytes(geometry: &Geometry, part: &Box3) -> u64 {
    let grid = BrickGrid::new(geometry.shape, EDGE);
    let inside = part.intersect(&geometry.domain());
    if inside.is_empty() {
        return 0;
    }
    let met = |a: usize| ((inside.hi[a] - 1) / EDGE - inside.lo[a] / EDGE + 1).unsigned_abs();
    (met(0) * met(1) * met(2)).saturating_mul((grid.brick_len() * size_of::<u32>()) as u64)
}

/// The label volume in bricks of its own.
pub(super) fn labels_of(engine: &Engine, geometry: &Geometry, joined: &Joined<'_>) -> Result<BrickArray<u32>> {
    let grid = BrickGrid::new(geometry.shape, EDGE);
    let is_empty = |id| BoxSource::<u32>::constant_in(joined, &grid.brick_box(id)) == Some(0);
    let set = Arc::new(BrickSet::from_fn(grid, |id| !is_empty(id)));
    let kept = BrickArray::new(engine.scratch(), &set)?;
    let stage = engine.stage("labels", set.len() as u64);
    let slots: Vec<Slot> = set.owned().collect();
    stage.run(&slots, &Workers::new(Vec::new), |labels: &mut Vec<u32>, &slot| {
        let part = grid.brick_box(set.id(slot));
        labels.resize(part.len(), 0);
        joined.read_box(&part, labels)?;
        kept.write_box(&part, labels);
        Ok(())
    })?;
    stage.finish();
    Ok(kept)
}

/// The objects without what they were solved with.
pub(super) fn objects_of(solved: Vec<Solved>) -> (Vec<KeptObject>, Vec<ObjectReport>) {
    let kept = |Solved { geometry, u, report, .. }: Solved| (KeptObject { label: report.label, geometry, u }, report);
    solved.into_iter().map(kept).unzip()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bricks_that_a_box_meets_are_counted() {
        let geometry = Geometry { shape: [130, 64, 200], spacing: [1.0; 3], origin: [0.0; 3], unit: None };
        let grid = BrickGrid::new(geometry.shape, EDGE);
        for (lo, hi) in
            [([0; 3], [130, 64, 200]), ([63, 0, 64], [65, 1, 128]), ([-20, -5, 190], [10, 80, 300]), ([-9; 3], [0; 3])]
        {
            let part = Box3::new(lo, hi);
            let met = (0..grid.len()).filter(|&id| !grid.brick_box(id).intersect(&part).is_empty()).count() as u64;
            assert_eq!(label_bytes(&geometry, &part), met * 64 * 64 * 64 * 4, "{part:?}");
        }
    }
}
