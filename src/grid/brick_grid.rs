//! `BrickGrid`: a domain cut into bricks of equal edge; those at the far ends may be cut short.

use super::Box3;

/// A brick's number in its grid: x fastest, z slowest.
pub type BrickId = u64;

/// A box of voxels starting at (0, 0, 0), cut into bricks of `edge`^3 voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BrickGrid {
    shape: [i64; 3],
    edge: i64,
    counts: [i64; 3],
}

impl BrickGrid {
    /// Cuts a domain of `shape` voxels into bricks.
    ///
    /// # Panics
    /// When `edge` or an extent is not positive: callers check what users give.
    #[must_use]
    pub fn new(shape: [i64; 3], edge: i64) -> Self {
        assert!(edge > 0 && shape.iter().all(|&n| n > 0), "a brick grid needs positive extents");
        Self { shape, edge, counts: shape.map(|n| (n + edge - 1) / edge) }
    }

    /// Voxels along each axis.
    #[must_use]
    pub fn shape(&self) -> [i64; 3] {
        self.shape
    }

    /// Voxels along a brick's edge.
    #[must_use]
    pub fn edge(&self) -> i64 {
        self.edge
    }

    /// Bricks along each axis.
    #[must_use]
    pub fn counts(&self) -> [i64; 3] {
        self.counts
    }

    /// Number of bricks.
    #[must_use]
    pub fn len(&self) -> u64 {
        self.counts.iter().map(|&n| n.unsigned_abs()).product()
    }

    /// Never: a brick grid has at least one brick.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Voxels a stored brick has room for.
    #[must_use]
    pub fn brick_len(&self) -> usize {
        (self.edge * self.edge * self.edge) as usize
    }

    /// A brick's place among the bricks.
    #[must_use]
    pub fn coords(&self, id: BrickId) -> [i64; 3] {
        let id = id as i64;
        [id % self.counts[0], id / self.counts[0] % self.counts[1], id / (self.counts[0] * self.counts[1])]
    }

    /// The brick at a place, or none beyond the domain.
    #[must_use]
    pub fn id_at(&self, coords: [i64; 3]) -> Option<BrickId> {
        (0..3)
            .all(|a| 0 <= coords[a] && coords[a] < self.counts[a])
            .then(|| ((coords[2] * self.counts[1] + coords[1]) * self.counts[0] + coords[0]) as BrickId)
    }

    /// The brick's voxels inside the domain: its valid box.
    #[must_use]
    pub fn brick_box(&self, id: BrickId) -> Box3 {
        let lo = self.coords(id).map(|c| c * self.edge);
        Box3::new(lo, std::array::from_fn(|a| (lo[a] + self.edge).min(self.shape[a])))
    }

    /// The brick beside `id` in the direction `offset`, or none beyond the domain.
    #[must_use]
    pub fn neighbour(&self, id: BrickId, offset: [i64; 3]) -> Option<BrickId> {
        let at = self.coords(id);
        self.id_at(std::array::from_fn(|a| at[a] + offset[a]))
    }

    /// The brick that holds a voxel of the domain.
    #[must_use]
    pub fn brick_of(&self, voxel: [i64; 3]) -> Option<BrickId> {
        self.id_at(voxel.map(|v| v.div_euclid(self.edge)))
    }

    /// The bricks that share voxels with `part`, in order of their numbers.
    pub fn bricks_in(&self, part: &Box3) -> impl Iterator<Item = BrickId> + use<> {
        let part = part.intersect(&Box3::from_shape(self.shape));
        let grid = *self;
        let empty = part.is_empty();
        let lo = part.lo.map(|v| v.div_euclid(grid.edge));
        let hi = part.hi.map(|v| (v - 1).div_euclid(grid.edge) + 1);
        let range = if empty { Box3::from_shape([0; 3]) } else { Box3::new(lo, hi) };
        range.rows().flat_map(move |(y, z)| (range.lo[0]..range.hi[0]).filter_map(move |x| grid.id_at([x, y, z])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boxes_tile_the_domain_once() {
        let grid = BrickGrid::new([33, 16, 7], 16);
        assert_eq!(grid.counts(), [3, 1, 1]);
        let total: u64 = (0..grid.len()).map(|id| grid.brick_box(id).volume()).sum();
        assert_eq!(total, 33 * 16 * 7);
        for id in 0..grid.len() {
            assert_eq!(grid.id_at(grid.coords(id)), Some(id));
            assert_eq!(grid.brick_of(grid.brick_box(id).lo), Some(id));
        }
    }

    #[test]
    fn bricks_in_a_part() {
        let grid = BrickGrid::new([64, 64, 64], 16);
        let ids: Vec<_> = grid.bricks_in(&Box3::new([15, 0, 0], [17, 16, 1])).collect();
        assert_eq!(ids, [0, 1]);
        assert_eq!(grid.bricks_in(&Box3::new([5, 5, 5], [5, 6, 6])).count(), 0);
        assert_eq!(grid.bricks_in(&Box3::new([-9, -9, -9], [99, 99, 99])).count(), 64);
    }
}
