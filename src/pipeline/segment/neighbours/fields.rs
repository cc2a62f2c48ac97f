//! What all steps of filling gaps read: labels by their outermost objects on a box and around it, and the bricks in which
//! there may be gaps.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::EDGE;
use super::joined::Joined;
use super::nesting::Nesting;
use super::survey::Survey;
use crate::error::Result;
use crate::grid::{Box3, BrickSet};
use crate::store::BoxSource;

/// A label volume in which nested objects count as the outermost around them.
pub(super) struct Roots<'a> {
    pub(super) labels: &'a Joined<'a>,
    roots: BTreeMap<u32, u32>,
}

impl<'a> Roots<'a> {
    pub(super) fn new(labels: &'a Joined<'a>, nesting: &Nesting) -> Self {
        Self { labels, roots: nesting.roots() }
    }

    /// The outermost object around a label.
    pub(super) fn of(&self, label: u32) -> u32 {
        self.roots.get(&label).copied().unwrap_or(label)
    }

    /// Reads the labels around a box, so many voxels along each axis; beyond the image its border is repeated.
    pub(super) fn around(&self, part: &Box3, halo: [i64; 3], out: &mut Vec<u32>) -> Result<Box3> {
        let around =
            Box3::new(std::array::from_fn(|a| part.lo[a] - halo[a]), std::array::from_fn(|a| part.hi[a] + halo[a]));
        let shape = BoxSource::<u32>::shape(self.labels);
        let inside = around.intersect(&Box3::from_shape(shape));
        let mut labels = vec![0; inside.len()];
        self.labels.read_box(&inside, &mut labels)?;
        if !self.roots.is_empty() {
            for label in &mut labels {
                *label = self.of(*label);
            }
        }
        out.clear();
        out.reserve(around.len());
        let clamp = |v: i64, a: usize| v.clamp(inside.lo[a], inside.hi[a] - 1);
        for (y, z) in around.rows() {
            let row = &labels[inside.offset_of([inside.lo[0], clamp(y, 1), clamp(z, 2)])..];
            out.extend((around.lo[0]..around.hi[0]).map(|x| row[(clamp(x, 0) - inside.lo[0]) as usize]));
        }
        Ok(around)
    }
}

/// The bricks within so many voxels of which there are two outermost objects, and those beside them.
pub(super) fn near_two(survey: &Survey, roots: &Roots<'_>, labels: &[u32], halo: [i64; 3]) -> Arc<BrickSet> {
    let grid = survey.grid;
    let of_object: Vec<u32> = labels.iter().map(|&label| roots.of(label)).collect();
    let mut keep = vec![false; grid.len() as usize];
    for id in 0..grid.len() {
        let part = grid.brick_box(id);
        let around =
            Box3::new(std::array::from_fn(|a| part.lo[a] - halo[a]), std::array::from_fn(|a| part.hi[a] + halo[a]));
        let mut near = grid.bricks_in(&around).flat_map(|id| &survey.present[id as usize]).map(|&n| of_object[n]);
        let Some(first) = near.next() else { continue };
        if near.any(|root| root != first) {
            grid.bricks_in(&part.grow(EDGE)).for_each(|id| keep[id as usize] = true);
        }
    }
    Arc::new(BrickSet::from_fn(grid, |id| keep[id as usize]))
}
