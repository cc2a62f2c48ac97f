//! Which resolution levels an image gets, and where their voxels lie.

use crate::grid::Geometry;

/// An image with no longer axis has one level: it is small enough for one 3-D texture of any viewer.
const LARGEST_SINGLE: i64 = 256;

/// The pyramid of others ends when no axis of a level is longer: a few chunks, so that the middle of the image is seen soon.
const COARSEST_EXTENT: i64 = 128;

/// One resolution level of an image.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelPlan {
    /// The level's grid; its voxels are centred on the blocks they cover.
    pub geometry: Geometry,
    /// Voxels of the level before that one voxel of this level covers along each axis, `[x, y, z]`; ones at level 0.
    pub factors: [i64; 3],
}

/// The levels of an image, finest first; level 0 is the image itself.
///
/// An axis is halved while its voxels are at most half as long as the longest side, so that voxels grow toward cubes;
/// from then on all axes are halved together. Axes of one voxel stay as they are. A block's voxel lies at the block's
/// centre: `(factor - 1) / 2` source voxels further on. An image of at most 256 voxels along each axis has one level; the coarsest
/// level of others has at most 128.
#[must_use]
pub fn plan_levels(geometry: &Geometry) -> Vec<LevelPlan> {
    let mut levels = vec![LevelPlan { geometry: geometry.clone(), factors: [1; 3] }];
    let mut finest = geometry.clone();
    let is_single = geometry.shape.iter().all(|&n| n <= LARGEST_SINGLE);
    while !is_single && finest.shape.iter().any(|&n| n > COARSEST_EXTENT) {
        let factors = next_factors(&finest);
        finest = coarser(&finest, factors);
        levels.push(LevelPlan { geometry: finest.clone(), factors });
    }
    levels
}

fn next_factors(geometry: &Geometry) -> [i64; 3] {
    // Spacings that were meant as a whole ratio may be off by rounding.
    const ROUNDING: f64 = 1.0 + 1e-6;
    let can_shrink = geometry.shape.map(|n| n > 1);
    let longest = (0..3).filter(|&a| can_shrink[a]).map(|a| geometry.spacing[a]).fold(0.0, f64::max);
    let finer: [bool; 3] = std::array::from_fn(|a| can_shrink[a] && 2.0 * geometry.spacing[a] <= longest * ROUNDING);
    let halved = if finer.contains(&true) { finer } else { can_shrink };
    halved.map(|yes| if yes { 2 } else { 1 })
}

fn coarser(geometry: &Geometry, factors: [i64; 3]) -> Geometry {
    let per_axis = |f: &dyn Fn(usize) -> f64| -> [f64; 3] { std::array::from_fn(f) };
    Geometry {
        shape: std::array::from_fn(|a| (geometry.shape[a] + factors[a] - 1) / factors[a]),
        spacing: per_axis(&|a| geometry.spacing[a] * factors[a] as f64),
        origin: per_axis(&|a| geometry.origin[a] + 0.5 * (factors[a] - 1) as f64 * geometry.spacing[a]),
        unit: geometry.unit.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(shape: [i64; 3], spacing: [f64; 3]) -> Geometry {
        Geometry { shape, spacing, origin: [100.0, -20.0, 3.0], unit: Some("micrometer".into()) }
    }

    fn factors(levels: &[LevelPlan]) -> Vec<[i64; 3]> {
        levels.iter().map(|level| level.factors).collect()
    }

    #[test]
    fn a_small_image_has_one_level() {
        let levels = plan_levels(&grid([256, 1, 17], [1.0, 2.0, 3.0]));
        assert_eq!(levels, [LevelPlan { geometry: grid([256, 1, 17], [1.0, 2.0, 3.0]), factors: [1; 3] }]);
    }

    #[test]
    fn fine_axes_shrink_until_voxels_are_near_cubes() {
        let levels = plan_levels(&grid([2048, 2047, 60], [0.25, 0.25, 1.0]));
        assert_eq!(factors(&levels), [[1, 1, 1], [2, 2, 1], [2, 2, 1], [2, 2, 2], [2, 2, 2]]);
        assert_eq!(levels[3].geometry.shape, [256, 256, 30]);
        assert_eq!(levels[3].geometry.spacing, [2.0, 2.0, 2.0]);
        // Centre of the first block of 8 x 8 x 2 voxels: 3.5 and 0.5 voxels from the first voxel's centre.
        assert_eq!(levels[3].geometry.origin, [100.875, -19.125, 3.5]);
        assert_eq!(levels[3].geometry.unit.as_deref(), Some("micrometer"));
    }

    #[test]
    fn a_large_image_has_a_level_that_is_a_few_chunks() {
        let coarsest = |n: i64| plan_levels(&grid([n, n, n], [1.0; 3])).last().unwrap().geometry.shape;
        assert_eq!([256, 257, 512, 1024, 1025].map(coarsest), [[256; 3], [65; 3], [128; 3], [128; 3], [65; 3]]);
    }

    #[test]
    fn nearly_equal_spacings_shrink_together() {
        assert_eq!(factors(&plan_levels(&grid([300, 300, 300], [1.0, 1.0, 1.7])))[1], [2; 3]);
        // 0.1 * 3 is not 0.3 in binary: still a ratio of two.
        assert_eq!(factors(&plan_levels(&grid([300, 300, 300], [0.15, 0.3, 0.1 * 3.0 - 1e-12])))[1], [2, 1, 1]);
    }

    #[test]
    fn flat_axes_stay() {
        let levels = plan_levels(&grid([5000, 400, 1], [0.5, 0.5, 100.0]));
        assert_eq!(factors(&levels)[1..], [[2, 2, 1]; 6]);
        assert_eq!(levels[6].geometry.shape, [79, 7, 1]);
        // A fine axis that is flat must not keep the others from shrinking.
        assert_eq!(factors(&plan_levels(&grid([1, 600, 600], [0.01, 1.0, 1.0])))[1], [1, 2, 2]);
    }
}
