//! `PointBins`: the points of a cloud sorted by the brick they lie in.

use super::brick_lists::{BrickLists, bricks_meeting};
use super::{Box3, BrickGrid, BrickId, BrickSet, Geometry};

/// For each brick of a grid, the points whose lower grid point lies in it, in order of their index.
#[derive(Clone, Debug)]
pub struct PointBins {
    grid: BrickGrid,
    lists: BrickLists,
}

impl PointBins {
    /// Sorts points into the bricks of `grid`; points outside of the domain are left out.
    ///
    /// # Panics
    /// With 2^31 points or more; callers refuse such clouds.
    #[must_use]
    pub fn new(grid: BrickGrid, geometry: &Geometry, positions: &[[f64; 3]]) -> Self {
        assert!(positions.len() < (u32::MAX >> 1) as usize, "source indices have 31 bits");
        let brick_of = |p: &[f64; 3]| {
            let base = geometry.to_voxels(*p).map(|v| v.floor() as i64);
            geometry.domain().contains(base).then(|| grid.brick_of(base)).flatten()
        };
        let listed = || (0..).zip(positions).filter_map(|(n, p)| Some((brick_of(p)?, n)));
        Self { grid, lists: BrickLists::new(listed) }
    }

    /// The grid whose bricks the points are sorted by.
    #[must_use]
    pub fn grid(&self) -> &BrickGrid {
        &self.grid
    }

    /// The points of one brick.
    #[must_use]
    pub fn of(&self, brick: BrickId) -> &[u32] {
        self.lists.of(brick)
    }

    /// The bricks that hold a voxel within `reach` voxels (along each axis) of the box around some brick's points.
    #[must_use]
    pub fn bricks_within(&self, geometry: &Geometry, positions: &[[f64; 3]], reach: [i64; 3]) -> BrickSet {
        let hull = |&brick: &BrickId| {
            let base = |&p: &u32| geometry.to_voxels(positions[p as usize]).map(|v| v.floor() as i64);
            let voxels = self.of(brick).iter().map(base).map(|v| Box3::new(v, v.map(|v| v + 2)));
            voxels.reduce(|hull, voxel| Box3 {
                lo: std::array::from_fn(|a| hull.lo[a].min(voxel.lo[a])),
                hi: std::array::from_fn(|a| hull.hi[a].max(voxel.hi[a])),
            })
        };
        bricks_meeting(self.grid, self.lists.bricks().iter().filter_map(hull), reach)
    }
}
