//! Marching cubes (Lorensen and Cline 1987) over one brick: the surface `u = level` as triangles.
//!
//! A cell is a cube of 2x2x2 neighbouring voxel centres; it belongs to the brick that holds its lowest corner.
//! A voxel is inside when `u >= level`. Triangles point outward, from inside to outside (counter-clockwise).

use super::tables::{CASES, axis_of, lower_corner};
use crate::grid::Box3;
use crate::kernel::surface::mesh::patch::Patch;
use crate::kernel::surface::mesh::vertex_key::VertexKey;

/// How close to a voxel centre a vertex may come, in voxels. Where a voxel has exactly the level, the vertices
/// on its edges would otherwise fall together and leave triangles without area.
const MARGIN: f64 = 1.0 / 1024.0;

const NO_VERTEX: u32 = u32::MAX;

/// The cells that belong to a brick, by their lowest corners, when the bricks cut up a domain of `shape` voxels.
///
/// With `closed_at_border` the domain is surrounded by one layer of cells that reach outside of it, and a
/// surface that runs into the border is closed there. The tile for the cells is their box grown by one voxel on
/// the upper side; voxels of it outside of the domain must hold a value below the level (0 for u).
#[must_use]
pub fn cells_of_brick(brick: &Box3, shape: [i64; 3], closed_at_border: bool) -> Box3 {
    let beyond = i64::from(closed_at_border);
    Box3 {
        lo: std::array::from_fn(|a| if brick.lo[a] == 0 { -beyond } else { brick.lo[a] }),
        hi: std::array::from_fn(|a| if brick.hi[a] == shape[a] { shape[a] - 1 + beyond } else { brick.hi[a] }),
    }
}

/// Finds the surface brick by brick; keeps its working memory between bricks.
#[derive(Clone, Debug)]
pub struct MarchingCubes {
    level: f32,
    /// The vertex on each edge of the tile, by `3 * (place of the lower voxel) + axis`.
    vertex_on: Vec<u32>,
}

impl MarchingCubes {
    /// For the surface `u = level`.
    #[must_use]
    pub fn new(level: f32) -> Self {
        Self { level, vertex_on: Vec::new() }
    }

    /// Bytes of memory that stay between bricks.
    #[must_use]
    pub fn bytes(&self) -> u64 {
        (self.vertex_on.capacity() * size_of::<u32>()) as u64
    }

    /// Fills `patch` with the surface in `cells`, given by their lowest corners.
    ///
    /// `values` is dense `[z][y][x]` over `part`, in voxel indices of the domain; it holds no NaN.
    ///
    /// # Panics
    /// When `part` does not hold both corners of every cell, or `values` has another length than `part`.
    pub fn extract(&mut self, values: &[f32], part: &Box3, cells: &Box3, patch: &mut Patch) {
        patch.cells = *cells;
        patch.keys.clear();
        patch.positions.clear();
        patch.triangles.clear();
        if cells.is_empty() {
            return;
        }
        let corners = Box3::new(cells.lo, cells.hi.map(|v| v + 1));
        assert!(part.intersect(&corners) == corners, "the tile must hold the corners of all cells");
        assert_eq!(values.len(), part.len(), "the tile must be dense over its box");
        self.vertex_on.clear();
        self.vertex_on.resize(3 * values.len(), NO_VERTEX);
        let tile = Tile { values, part: *part };
        for (y, z) in cells.rows() {
            self.walk_row(&tile, [cells.lo[0], y, z], cells.shape()[0] as usize, patch);
        }
    }

    /// The cells of one row, from `first` on along x.
    fn walk_row(&mut self, tile: &Tile<'_>, first: [i64; 3], count: usize, patch: &mut Patch) {
        let level = self.level;
        let [x, y, z] = first;
        let rows = [[x, y, z], [x, y + 1, z], [x, y, z + 1], [x, y + 1, z + 1]].map(|start| {
            let place = tile.part.offset_of(start);
            &tile.values[place..=place + count]
        });
        // The corners at one x are bits 0, 2, 4, 6 of a case; those at the next x are the bits above them.
        let column =
            |i: usize| rows.iter().enumerate().fold(0_u8, |bits, (r, row)| bits | u8::from(row[i] >= level) << (2 * r));
        let mut left = column(0);
        for i in 0..count {
            let right = column(i + 1);
            let case = left | right << 1;
            left = right;
            for triangle in &CASES[case as usize] {
                let corners = triangle.map(|edge| self.vertex(tile, [x + i as i64, y, z], edge, patch));
                patch.triangles.push(corners);
            }
        }
    }

    /// The vertex on an edge of a cell, made when its first triangle asks for it.
    fn vertex(&mut self, tile: &Tile<'_>, cell: [i64; 3], edge: u8, patch: &mut Patch) -> u32 {
        let (corner, axis) = (lower_corner(edge), axis_of(edge));
        let lower: [i64; 3] = std::array::from_fn(|a| cell[a] + i64::from(corner >> a & 1));
        let place = tile.part.offset_of(lower);
        let vertex = &mut self.vertex_on[3 * place + axis];
        if *vertex == NO_VERTEX {
            let mut upper = lower;
            upper[axis] += 1;
            let mut position = lower.map(|v| v as f64);
            position[axis] += fraction(tile.values[place], tile.values[tile.part.offset_of(upper)], self.level);
            *vertex = patch.keys.len() as u32;
            patch.keys.push(VertexKey::on_edge(lower, axis));
            patch.positions.push(position);
        }
        *vertex
    }
}

struct Tile<'a> {
    values: &'a [f32],
    part: Box3,
}

/// Where the level is crossed on the way from the lower to the upper voxel, at least `MARGIN` off both.
///
/// Both values and their order are the same for every brick that shares the edge, and so are the bits.
#[must_use]
pub fn fraction(lower: f32, upper: f32, level: f32) -> f64 {
    let [lower, upper, level] = [lower, upper, level].map(f64::from);
    let at = (level - lower) / (upper - lower);
    if at.is_nan() { 0.5 } else { at.clamp(MARGIN, 1.0 - MARGIN) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fraction_is_linear_and_stays_off_the_ends() {
        assert_eq!(fraction(0.0, 1.0, 0.25), 0.25);
        assert_eq!(fraction(2.0, 1.0, 1.25), 0.75);
        assert_eq!(fraction(0.5, 0.0, 0.5), MARGIN);
        assert_eq!(fraction(0.0, 0.5, 0.5), 1.0 - MARGIN);
        assert_eq!(fraction(f32::NEG_INFINITY, f32::INFINITY, 0.0), 0.5);
    }

    #[test]
    fn every_cell_belongs_to_one_brick() {
        let shape = [5, 4, 3];
        for closed in [false, true] {
            let grid = crate::grid::BrickGrid::new(shape, 2);
            let mut cells: Vec<[i64; 3]> = (0..grid.len())
                .flat_map(|id| {
                    let cells = cells_of_brick(&grid.brick_box(id), shape, closed);
                    cells.rows().flat_map(move |(y, z)| (cells.lo[0]..cells.hi[0]).map(move |x| [z, y, x]))
                })
                .collect();
            let count = cells.len();
            cells.sort_unstable();
            cells.dedup();
            let expected = if closed { 6 * 5 * 4 } else { 4 * 3 * 2 };
            assert_eq!((count, cells.len()), (expected, expected));
        }
    }

    #[test]
    fn a_plane_is_found_where_it_lies() {
        let part = Box3::new([-1, 4, 7], [3, 7, 10]);
        let values: Vec<f32> = part.rows().flat_map(|_| (-1..3).map(|x| 0.7 - 0.4 * x as f32)).collect();
        let mut patch = Patch::default();
        MarchingCubes::new(0.5).extract(&values, &part, &Box3::new([-1, 4, 7], [2, 6, 9]), &mut patch);
        assert_eq!((patch.positions.len(), patch.triangles.len()), (9, 8));
        assert!(patch.positions.iter().all(|p| (p[0] - 0.5).abs() < 1e-6));
        for [a, b, c] in patch.triangles.iter().map(|t| t.map(|v| patch.positions[v as usize])) {
            let normal_x = (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1]);
            assert!(normal_x > 0.5, "u falls along x, so outward is +x");
        }
    }
}
