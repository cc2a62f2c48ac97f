//! Where an object of parallel sections ends: no farther beyond the first and last of them than the next one would have
//! been marked. An end is round, and narrows to a point there; but where that is near beside the section's width it is
//! flat, and half way there.

use glam::DVec3;

use crate::kernel::outline::planar::section::{Section, widest_gap};

/// The ends of an object along the normal of its sections.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ends {
    normal: DVec3,
    /// Offsets of the first and last section.
    marked: [f64; 2],
    /// How far beyond them the next ones would have been marked.
    height: f64,
    /// How far beyond them it ends, at the latest.
    reach: [f64; 2],
}

/// Ends are round from this part of a section's depth on.
const ROUND: f64 = 0.3;

impl Ends {
    /// The ends of sections of one direction, in order of their offsets: their widest distance beyond the first and last;
    /// of a single one its radius. None where they have several directions.
    #[must_use]
    pub fn of(sections: &[&Section]) -> Option<Self> {
        let (first, last) = (sections.first()?, sections.last()?);
        if !sections.iter().all(|section| section.plane.is_parallel_to(&first.plane)) {
            return None;
        }
        let gap = widest_gap(sections);
        let height = if gap > 0.0 { gap } else { first.radius() };
        let reach = [first, last].map(|section| {
            let depth = section.deepest().map_or(0.0, |(_, depth)| depth);
            if height < ROUND * depth { 0.5 * height } else { height }
        });
        Some(Self { normal: first.plane.normal.into(), marked: [first.plane.offset, last.plane.offset], height, reach })
    }

    /// How far the object reaches along the normal, at the most.
    #[must_use]
    pub fn extent(&self) -> f64 {
        self.marked[1] - self.marked[0] + self.reach[0] + self.reach[1]
    }

    /// How far beyond its sections an object may reach at the farthest.
    #[must_use]
    pub fn height(&self) -> f64 {
        self.height
    }

    /// How far beyond the first and last section the object narrows to a point; none where it ends flat.
    #[must_use]
    pub fn round(&self) -> [Option<f64>; 2] {
        self.reach.map(|reach| (reach == self.height).then_some(reach))
    }

    /// Where a point lies along the normal.
    #[must_use]
    pub fn offset(&self, point: [f64; 3]) -> f64 {
        self.normal.dot(point.into())
    }

    /// How far a point lies beyond the nearer section at an end; 0 between both.
    #[must_use]
    pub fn beyond_sections(&self, point: [f64; 3]) -> f64 {
        let along = self.offset(point);
        (self.marked[0] - along).max(along - self.marked[1]).max(0.0)
    }

    /// How far a point lies beyond the nearer end; negative between both.
    #[must_use]
    pub fn beyond(&self, point: [f64; 3]) -> f64 {
        let along = self.offset(point);
        (self.marked[0] - self.reach[0] - along).max(along - self.marked[1] - self.reach[1])
    }
}
