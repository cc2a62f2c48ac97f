//! The surface of a cloud with normals as a level set, where no inside is told by the points' distance alone (docs/algorithms.md,
//! "Open surfaces").

use rstar::RTree;
use rstar::primitives::GeomWithData;

use super::near::Near;
use crate::error::Result;
use crate::exec::{Engine, Stage, Workers, one_wave};
use crate::grid::{Box3, Geometry};
use crate::kernel::points::facing::level_of_block;
use crate::kernel::points::surfel::Surfel;
use crate::store::BrickArray;

/// Voxels along each axis that share the points around them.
const BLOCK: i64 = 4;
/// Points within so many largest spacings of the middle of a block count.
const REACH_VOXELS: f64 = 8.0;
/// How smooth the mean of the heights is, in largest spacings: less than points are apart.
const SMOOTH_VOXELS: f64 = 0.5;
/// From 1 to 0 it is so many.
const WIDTH_VOXELS: f64 = 4.0;

/// The surface of the points as a level set over this rank's cells `near` them: 1/2 on it, more below, and 0 where no points
/// are near.
///
/// # Errors
/// When scratch runs out or the run is interrupted.
pub(super) fn level_set(
    stage: &Stage<'_>,
    engine: &Engine,
    geometry: &Geometry,
    surfels: &[Surfel],
    near: Near<'_>,
) -> Result<BrickArray<f32>> {
    let set = near.distance.set();
    let u = BrickArray::with_faces(engine.scratch(), set)?;
    let numbered = surfels.iter().zip(0..).map(|(surfel, n)| GeomWithData::new(surfel.place.to_array(), n));
    let tree: RTree<GeomWithData<[f64; 3], u32>> = RTree::bulk_load(numbered.collect());
    let [reach, smooth, width] =
        [REACH_VOXELS, SMOOTH_VOXELS, WIDTH_VOXELS].map(|voxels| voxels * geometry.max_spacing());
    stage.run(&one_wave(set), &Workers::none(), |(), &slot| {
        let (part, edge) = (set.grid().brick_box(set.id(slot)), set.grid().edge());
        u.write(slot, |u| {
            u.fill(0.0);
            for block in blocks(&part) {
                let middle = middle_of(geometry, &block);
                let mut near: Vec<u32> =
                    tree.locate_within_distance(middle, reach * reach).map(|point| point.data).collect();
                near.sort_unstable();
                let near: Vec<Surfel> = near.into_iter().map(|n| surfels[n as usize]).collect();
                level_of_block(geometry, (&part, edge), &block, (&near, smooth, width), u);
            }
        });
        u.refresh_faces(slot);
        Ok(())
    })?;
    Ok(u)
}

/// The middle of the voxels of a box, world coordinates.
fn middle_of(geometry: &Geometry, part: &Box3) -> [f64; 3] {
    std::array::from_fn(|a| geometry.origin[a] + 0.5 * (part.lo[a] + part.hi[a] - 1) as f64 * geometry.spacing[a])
}

/// The blocks of a brick.
fn blocks(part: &Box3) -> impl Iterator<Item = Box3> {
    let part = *part;
    let counts = part.shape().map(|n| (n + BLOCK - 1) / BLOCK);
    let all = Box3::from_shape(counts);
    (0..all.len()).map(move |n| {
        let lo = all.voxel_at(n).map(|v| v * BLOCK);
        let lo: [i64; 3] = std::array::from_fn(|a| part.lo[a] + lo[a]);
        Box3::new(lo, lo.map(|v| v + BLOCK)).intersect(&part)
    })
}
