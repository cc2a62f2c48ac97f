//! Which objects have voxels in which brick, how many voxels they have, and how many each two share.

use std::collections::BTreeMap;

use super::EDGE;
use crate::error::Result;
use crate::exec::{Stage, Workers};
use crate::grid::{Box3, BrickGrid, BrickId, Geometry};
use crate::pipeline::segment::labels::Placed;
use crate::store::BoxSource;

/// Objects are named by their place among all, in order of their labels.
pub(super) struct Survey {
    /// The boxes that everything is computed in.
    pub(super) grid: BrickGrid,
    /// The objects with voxels in each brick.
    pub(super) present: Vec<Vec<usize>>,
    /// Voxels of each object.
    pub(super) voxels: Vec<u64>,
    /// Voxels that two objects share, the first one first.
    pub(super) shared: BTreeMap<[usize; 2], u64>,
    /// The bricks with such voxels.
    pub(super) overlapping: Vec<BrickId>,
}

/// What one brick holds.
#[derive(Default)]
struct Brick {
    objects: Vec<(usize, u64)>,
    shared: BTreeMap<[usize; 2], u64>,
}

impl Placed<'_> {
    /// The segmentation function on a box of the image's grid, 0 beyond the object's own; false where that is 0 all over.
    pub(super) fn read(&self, part: &Box3, out: &mut Vec<f32>) -> Result<bool> {
        out.clear();
        out.resize(part.len(), 0.0);
        let to_own = self.window.lo.map(|v| -v);
        let inside = part.intersect(&self.window);
        let own = inside.translate(to_own);
        if own.is_empty() || self.u.constant_in(&own).is_some_and(|u| u < 0.5) {
            return Ok(false);
        }
        let mut values = vec![0.0; own.len()];
        self.u.read_box(&own, &mut values)?;
        for (row, (y, z)) in values.chunks_exact(own.shape()[0] as usize).zip(inside.rows()) {
            out[part.offset_of([inside.lo[0], y, z])..][..row.len()].copy_from_slice(row);
        }
        Ok(true)
    }
}

/// Looks at all objects, which come in order of their labels.
pub(super) fn survey(stage: &Stage<'_>, geometry: &Geometry, objects: &[Placed<'_>]) -> Result<Survey> {
    let grid = BrickGrid::new(geometry.shape, EDGE);
    let mut near = vec![Vec::new(); grid.len() as usize];
    for (n, object) in objects.iter().enumerate() {
        grid.bricks_in(&object.window).for_each(|id| near[id as usize].push(n));
    }
    let bricks: Vec<BrickId> = (0..grid.len()).collect();
    let found = stage.run(&bricks, &Workers::new(Vec::new), |values, &id| {
        examine(objects, &near[id as usize], &grid.brick_box(id), values)
    })?;
    let mut survey = Survey {
        grid,
        present: Vec::with_capacity(found.len()),
        voxels: vec![0; objects.len()],
        shared: BTreeMap::new(),
        overlapping: Vec::new(),
    };
    for (id, brick) in bricks.into_iter().zip(found) {
        brick.objects.iter().for_each(|&(n, voxels)| survey.voxels[n] += voxels);
        if !brick.shared.is_empty() {
            survey.overlapping.push(id);
        }
        for (pair, voxels) in brick.shared {
            *survey.shared.entry(pair).or_default() += voxels;
        }
        survey.present.push(brick.objects.into_iter().map(|(n, _)| n).collect());
    }
    Ok(survey)
}

fn examine(objects: &[Placed<'_>], near: &[usize], part: &Box3, values: &mut Vec<f32>) -> Result<Brick> {
    let mut brick = Brick::default();
    // The objects at each voxel, where there are several in the brick.
    let mut masks: Vec<Vec<bool>> = Vec::new();
    for &n in near {
        if !objects[n].read(part, values)? {
            continue;
        }
        let mask: Vec<bool> = values.iter().map(|u| *u >= 0.5).collect();
        let voxels = mask.iter().filter(|inside| **inside).count() as u64;
        if voxels == 0 {
            continue;
        }
        for ((other, _), theirs) in brick.objects.iter().zip(&masks) {
            let both = mask.iter().zip(theirs).filter(|(a, b)| **a && **b).count() as u64;
            if both > 0 {
                brick.shared.insert([*other, n], both);
            }
        }
        brick.objects.push((n, voxels));
        masks.push(mask);
    }
    Ok(brick)
}
