//! `PointBins`: the points of a cloud sorted by the brick they lie in.

use super::{Box3, BrickGrid, BrickId, BrickSet, Geometry};

/// For each brick of a grid, the points whose lower grid point lies in it, in order of their index.
#[derive(Clone, Debug)]
pub struct PointBins {
    grid: BrickGrid,
    starts: Vec<u32>,
    order: Vec<u32>,
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
        let mut starts = vec![0u32; grid.len() as usize + 1];
        for brick in positions.iter().filter_map(brick_of) {
            starts[brick as usize + 1] += 1;
        }
        for n in 1..starts.len() {
            starts[n] += starts[n - 1];
        }
        let mut next = starts.clone();
        let mut order = vec![0; starts[starts.len() - 1] as usize];
        for (index, brick) in positions.iter().enumerate().filter_map(|(n, p)| Some((n, brick_of(p)?))) {
            order[next[brick as usize] as usize] = index as u32;
            next[brick as usize] += 1;
        }
        Self { grid, starts, order }
    }

    /// The grid whose bricks the points are sorted by.
    #[must_use]
    pub fn grid(&self) -> &BrickGrid {
        &self.grid
    }

    /// The points of one brick.
    #[must_use]
    pub fn of(&self, brick: BrickId) -> &[u32] {
        &self.order[self.starts[brick as usize] as usize..self.starts[brick as usize + 1] as usize]
    }

    /// The bricks that hold a voxel within `reach` voxels (along each axis) of the box around some brick's points.
    #[must_use]
    pub fn bricks_within(&self, geometry: &Geometry, positions: &[[f64; 3]], reach: [i64; 3]) -> BrickSet {
        let mut keep = vec![false; self.grid.len() as usize];
        for brick in 0..self.grid.len() {
            let mut voxels =
                self.of(brick).iter().map(|&p| geometry.to_voxels(positions[p as usize]).map(|v| v.floor() as i64));
            let Some(first) = voxels.next() else { continue };
            let hull = voxels.fold(Box3::new(first, first.map(|v| v + 2)), |hull, v| Box3 {
                lo: std::array::from_fn(|a| hull.lo[a].min(v[a])),
                hi: std::array::from_fn(|a| hull.hi[a].max(v[a] + 2)),
            });
            let grown = Box3 {
                lo: std::array::from_fn(|a| hull.lo[a] - reach[a]),
                hi: std::array::from_fn(|a| hull.hi[a] + reach[a]),
            };
            self.grid.bricks_in(&grown).for_each(|id| keep[id as usize] = true);
        }
        BrickSet::from_fn(self.grid, |id| keep[id as usize])
    }
}
