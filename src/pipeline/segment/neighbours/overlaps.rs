//! Voxels that several objects claim: a nested object's go to it; else the object gets them in which they lie deeper.
//!
//! How deep is the distance to the nearest voxel that the object does not claim: u itself is 0 or 1 within two voxels of
//! the surface and tells nothing. It is looked for in the brick and around, at first a few voxels and then twice as far,
//! until at most one object has no such voxel; what is found does not depend on how far was looked.

use std::sync::Arc;

use super::nesting::Nesting;
use super::survey::Survey;
use crate::error::Result;
use crate::exec::{Engine, Stage, Workers};
use crate::grid::{Box3, BrickId, BrickSet, Geometry};
use crate::kernel::image::morphology::nearness::Nearness;
use crate::pipeline::segment::labels::Placed;
use crate::store::BrickArray;

/// How far, in smallest spacings, is looked at first and at most. Beyond, objects count as equally deep.
const REACHES: std::ops::RangeInclusive<u32> = 3..=6;

/// What the objects are and how they lie.
struct Overlaps<'a> {
    geometry: &'a Geometry,
    objects: &'a [Placed<'a>],
    survey: &'a Survey,
    nesting: &'a Nesting,
}

/// Settles all bricks with contested voxels: their labels, and the number of such voxels. None where there are none.
pub(super) fn settle(
    stage: &Stage<'_>,
    engine: &Engine,
    geometry: &Geometry,
    objects: &[Placed<'_>],
    survey: &Survey,
    nesting: &Nesting,
) -> Result<Option<(BrickArray<u32>, u64)>> {
    if survey.overlapping.is_empty() {
        return Ok(None);
    }
    let overlaps = Overlaps { geometry, objects, survey, nesting };
    let set = Arc::new(BrickSet::from_fn(survey.grid, |id| survey.overlapping.binary_search(&id).is_ok()));
    let labels = BrickArray::new(engine.scratch(), &set)?;
    let contested = stage.run(&survey.overlapping, &Workers::none(), |(), &id| {
        let (settled, contested) = overlaps.settle(id)?;
        labels.write_box(&survey.grid.brick_box(id), &settled);
        Ok(contested)
    })?;
    Ok(Some((labels, contested.iter().sum())))
}

impl Overlaps<'_> {
    /// The labels of a brick, and how many voxels were contested.
    fn settle(&self, id: BrickId) -> Result<(Vec<u32>, u64)> {
        let part = self.survey.grid.brick_box(id);
        let present = &self.survey.present[id as usize];
        let mut fields = vec![Vec::new(); present.len()];
        for (field, &n) in fields.iter_mut().zip(present) {
            self.objects[n].read(&part, field)?;
        }
        let mut labels = vec![0; part.len()];
        // The voxels that are left to be told apart, with their claimants as places among the present.
        let mut contested: Vec<(usize, Vec<usize>)> = Vec::new();
        for (at, label) in labels.iter_mut().enumerate() {
            let claims: Vec<usize> = (0..present.len()).filter(|&n| fields[n][at] >= 0.5).collect();
            let holds_other = |n: usize| claims.iter().any(|&m| self.nesting.holds(present[n], present[m]));
            let innermost: Vec<usize> = claims.iter().copied().filter(|&n| !holds_other(n)).collect();
            match innermost.as_slice() {
                [] => {}
                [one] => *label = self.objects[present[*one]].label,
                _ => contested.push((at, innermost)),
            }
        }
        let count = contested.len() as u64;
        for reach in REACHES {
            if contested.is_empty() {
                break;
            }
            let depths = self.depths(&part, present, &contested, f64::from(1_u32 << reach))?;
            contested.retain(|(at, claims)| {
                let is_known = claims.iter().filter(|&&n| depths[n][*at].is_infinite()).count() < 2;
                if is_known || reach == *REACHES.end() {
                    // The first of those that are best has the lowest label.
                    let better = |a: &usize, b: &usize| {
                        let (a, b) = ((depths[*a][*at], fields[*a][*at], *b), (depths[*b][*at], fields[*b][*at], *a));
                        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2))
                    };
                    labels[*at] = claims.iter().copied().max_by(better).map_or(0, |n| self.objects[present[n]].label);
                }
                !is_known
            });
        }
        Ok((labels, count))
    }

    /// The squared depth of voxels in each object that claims contested ones, so many smallest spacings far.
    fn depths(
        &self,
        part: &Box3,
        present: &[usize],
        contested: &[(usize, Vec<usize>)],
        reach: f64,
    ) -> Result<Vec<Vec<f32>>> {
        let mut nearness = Nearness::new(self.geometry.spacing, reach * self.geometry.min_spacing());
        let halo = nearness.halo();
        let around =
            Box3::new(std::array::from_fn(|a| part.lo[a] - halo[a]), std::array::from_fn(|a| part.hi[a] + halo[a]));
        let (mut values, mut found) = (Vec::new(), Vec::new());
        let mut depths = vec![Vec::new(); present.len()];
        for (n, depths) in depths.iter_mut().enumerate() {
            if !contested.iter().any(|(_, claims)| claims.contains(&n)) {
                continue;
            }
            self.objects[present[n]].read(&around, &mut values)?;
            nearness.squared(around.shape(), |at| values[at] < 0.5, &mut found);
            depths.extend(part.rows().flat_map(|(y, z)| {
                let start = around.offset_of([part.lo[0], y, z]);
                found[start..start + part.shape()[0] as usize].iter().copied()
            }));
        }
        Ok(depths)
    }
}
