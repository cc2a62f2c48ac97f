//! `TriangleBins`: the triangles of a mesh sorted by the bricks whose voxels they may fix.

use super::brick_lists::{BrickLists, bricks_meeting};
use super::{Box3, BrickGrid, BrickId, BrickSet, Geometry, TriangleMesh, VoxelTriangle};

/// For each brick of a grid, the triangles that cut a cell with a corner in the brick, in order of their index.
///
/// A triangle is listed in every brick that it concerns. Those outside of the domain are left out, but for what
/// reaches the outermost voxels from the cells right beside them.
#[derive(Clone, Debug)]
pub struct TriangleBins {
    grid: BrickGrid,
    /// A large triangle lies in many bricks.
    lists: BrickLists,
}

impl TriangleBins {
    /// Sorts triangles into the bricks of `grid`. Two passes over the mesh, 4 bytes for each triangle in each brick.
    ///
    /// # Panics
    /// With more than [`MOST_SOURCES`](super::MOST_SOURCES) triangles, or corners that do not exist; a mesh made by
    /// [`TriangleMesh::new`] has neither.
    #[must_use]
    pub fn new(grid: BrickGrid, geometry: &Geometry, mesh: &TriangleMesh) -> Self {
        assert!(mesh.len() <= super::MOST_SOURCES, "source indices have 31 bits");
        let bricks_of = |n: usize| {
            let triangle = VoxelTriangle::new(geometry, mesh.corners(n));
            let bricks = grid.bricks_in(&triangle.voxels());
            bricks.filter(move |&id| triangle.meets(&cells_beside(&grid.brick_box(id))))
        };
        let listed = || (0..mesh.len()).flat_map(|n| bricks_of(n).map(move |brick| (brick, n as u32)));
        Self { grid, lists: BrickLists::new(listed) }
    }

    /// The triangles that may fix voxels of a brick.
    #[must_use]
    pub fn of(&self, brick: BrickId) -> &[u32] {
        self.lists.of(brick)
    }

    /// The bricks that hold a voxel within `reach` voxels (along each axis) of the box around what some brick's
    /// triangles may fix in it.
    ///
    /// # Panics
    /// When `mesh` is not the one that was sorted.
    #[must_use]
    pub fn bricks_within(&self, geometry: &Geometry, mesh: &TriangleMesh, reach: [i64; 3]) -> BrickSet {
        let hull = |&brick: &BrickId| {
            let own = self.grid.brick_box(brick);
            let voxels = |&n: &u32| VoxelTriangle::new(geometry, mesh.corners(n as usize)).voxels().intersect(&own);
            self.of(brick).iter().map(voxels).reduce(|a, b| Box3 {
                lo: std::array::from_fn(|i| a.lo[i].min(b.lo[i])),
                hi: std::array::from_fn(|i| a.hi[i].max(b.hi[i])),
            })
        };
        bricks_meeting(self.grid, self.lists.bricks().iter().filter_map(hull), reach)
    }
}

/// The cells that have a corner among the voxels of `part`.
#[must_use]
pub fn cells_beside(part: &Box3) -> Box3 {
    Box3::new(part.lo.map(|v| v - 1), part.hi)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lists by asking each triangle for each cell of each brick.
    fn plainly(grid: BrickGrid, geometry: &Geometry, mesh: &TriangleMesh, brick: BrickId) -> Vec<u32> {
        let cells = cells_beside(&grid.brick_box(brick));
        let is_cut = |n: &usize| {
            let triangle = VoxelTriangle::new(geometry, mesh.corners(*n));
            let mut cells = cells.rows().flat_map(|(y, z)| (cells.lo[0]..cells.hi[0]).map(move |x| [x, y, z]));
            cells.any(|cell| triangle.meets(&Box3::new(cell, cell.map(|v| v + 1))))
        };
        (0..mesh.len()).filter(is_cut).map(|n| n as u32).collect()
    }

    #[test]
    fn each_brick_has_the_triangles_that_cut_its_cells() {
        let geometry = Geometry { shape: [20, 13, 9], spacing: [0.5, 1.0, 2.0], origin: [1.0, -2.0, 0.0], unit: None };
        let corner = |n: u32| {
            let part = |k: u32| f64::from((n * 7919 + k * 104_729) % 1009) / 1009.0;
            [1.0 + 12.0 * part(1) - 1.0, -2.0 + 14.0 * part(2), 20.0 * part(3) - 1.0]
        };
        let vertices: Vec<_> = (0..90).map(corner).collect();
        let triangles = (0..30).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).chain([[0, 0, 0], [4, 5, 5]]).collect();
        let mesh = TriangleMesh::new(vertices, triangles).unwrap();
        let grid = BrickGrid::new(geometry.shape, 4);
        let bins = TriangleBins::new(grid, &geometry, &mesh);
        let mut listed = 0;
        for brick in 0..grid.len() {
            assert_eq!(bins.of(brick), plainly(grid, &geometry, &mesh, brick), "brick {brick}");
            listed += bins.of(brick).len();
        }
        assert!(listed > 200);
        let near = bins.bricks_within(&geometry, &mesh, [0; 3]);
        assert!((0..grid.len()).all(|brick| bins.of(brick).is_empty() || near.slot(brick).is_some()));
    }
}
