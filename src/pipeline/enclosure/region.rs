//! Where a cloud's surface is solved: the box around it and the cells near it, for the run and for its estimate alike.

use super::needs::box_bytes;
use crate::grid::{Box3, BrickGrid, BrickSet, Geometry, PointBins};
use crate::kernel::level_set::cell::CELL;

/// The grid around a cloud, and its cells within a distance of it.
pub struct RegionOfInterest {
    /// The grid of the box.
    pub geometry: Geometry,
    /// The box in voxels of the grid it was cut out of; may reach past it.
    pub window: Box3,
    /// The points by cell.
    pub bins: PointBins,
    /// The cells within the distance.
    pub cells: BrickSet,
}

impl RegionOfInterest {
    /// The number of cells that the grid of such a box has, near the cloud or not.
    #[must_use]
    pub fn grid_cells(grid: &Geometry, cloud: &[[f64; 3]], farthest: f64) -> u64 {
        BrickGrid::new(grid_around(grid, &voxel_bounds(cloud, grid), farthest).0.shape, CELL as i64).len()
    }

    /// What such a box holds while a surface is solved in it.
    #[must_use]
    pub(crate) fn held(&self, cloud: &[[f64; 3]]) -> u64 {
        box_bytes(cloud.len() as u64, self.cells.grid().len(), self.cells.len() as u64)
    }

    /// What lies within `farthest` (physical) of `cloud`.
    #[must_use]
    pub fn new(grid: &Geometry, cloud: &[[f64; 3]], farthest: f64) -> Self {
        let (geometry, window) = grid_around(grid, &voxel_bounds(cloud, grid), farthest);
        let bins = PointBins::new(BrickGrid::new(geometry.shape, CELL as i64), &geometry, cloud);
        let reach = geometry.spacing.map(|h| (farthest / h).ceil() as i64 + 1);
        let cells = bins.bricks_within(&geometry, cloud, reach);
        Self { geometry, window, bins, cells }
    }
}

/// The voxels of a grid that hold the cloud; may reach past it.
#[must_use]
pub fn voxel_bounds(cloud: &[[f64; 3]], grid: &Geometry) -> Box3 {
    let mut voxels = cloud.iter().map(|&p| grid.to_voxels(p));
    let first = voxels.next().unwrap_or_default();
    let (lo, hi) = voxels.fold((first, first), |(lo, hi), v| {
        (std::array::from_fn(|a| lo[a].min(v[a])), std::array::from_fn(|a| hi[a].max(v[a])))
    });
    Box3::new(lo.map(|v| v.floor() as i64), hi.map(|v| v.ceil() as i64 + 1))
}

/// The box: the cloud and a margin, starting at a whole cell of the grid.
fn grid_around(grid: &Geometry, bounds: &Box3, farthest: f64) -> (Geometry, Box3) {
    let cell = CELL as i64;
    let margin: [i64; 3] = grid.spacing.map(|h| (farthest / h).ceil() as i64 + 2);
    let window = Box3 {
        lo: std::array::from_fn(|a| (bounds.lo[a] - margin[a]).div_euclid(cell) * cell),
        hi: std::array::from_fn(|a| bounds.hi[a] + margin[a]),
    };
    (grid.crop(&window), window)
}
