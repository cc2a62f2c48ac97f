//! Initialisation from a triangle mesh (Kósa & Mikula 2023, Alg. 6; docs/algorithms.md, "Triangles").
//!
//! All corners of every cell that a triangle cuts are fixed at their exact distance to it (point–triangle distance:
//! Eberly 1999); a grid point keeps the smallest one and that triangle; of equal distances the lower label wins, then
//! the lower index, whatever the order in which triangles come. A triangle without area acts as a segment or point, and fixes what a
//! point cloud's point there would. Cells are those of `floor`, half-open: a triangle that lies in a grid plane fixes
//! that plane's points and the next one's above. Cells that stick out of the grid count for the voxels they share
//! with it. In: positions in f64, `[x, y, z]`, physical; out: squared lengths. No halo; a brick needs the triangles
//! that `TriangleBins` lists for it.

use crate::grid::{Box3, Geometry, VoxelTriangle, cells_beside};
use crate::kernel::distance::state::source::counts_before;
use crate::kernel::geometry::triangle::Triangle;

/// Visits each cell that a triangle cuts and that has a corner among the voxels of `part`, once, by its lowest grid
/// point, in no particular order.
///
/// `corners` are world positions. The cost follows the number of cells that are cut, not the size of `part`: boxes of
/// cells are halved until they are single cells or the triangle misses them.
pub fn cut_cells(geometry: &Geometry, corners: [[f64; 3]; 3], part: &Box3, mut visit: impl FnMut([i64; 3])) {
    let triangle = VoxelTriangle::new(geometry, corners);
    halve(&triangle, &cells_beside(part).intersect(&triangle.cells()), &mut visit);
}

fn halve(triangle: &VoxelTriangle, cells: &Box3, visit: &mut impl FnMut([i64; 3])) {
    if cells.is_empty() || !triangle.meets(cells) {
        return;
    }
    let shape = cells.shape();
    let axis = (0..3).fold(0, |longest, a| if shape[a] > shape[longest] { a } else { longest });
    if shape[axis] == 1 {
        return visit(cells.lo);
    }
    let (mut below, mut above) = (*cells, *cells);
    below.hi[axis] = cells.lo[axis] + shape[axis] / 2;
    above.lo[axis] = below.hi[axis];
    halve(triangle, &below, visit);
    halve(triangle, &above, visit);
}

/// Fixes the voxels of `part` beside the given triangles, each with its index and its corners as world positions.
///
/// `squared` holds squared distances (start: infinity), `source` the index of the fixing triangle (start:
/// `NO_SOURCE`), points that were there before among them, each with a `label`; both
/// dense `[z][y][x]` with room for `edge`^3 voxels from `part.lo` on. Returns how many distances it computed: for each voxel one to each triangle that cuts a cell beside it, so that
/// the sum over parts of a grid is that of the grid. Scratch: 4 bytes a voxel.
pub fn fix_voxels(
    geometry: &Geometry,
    part: &Box3,
    edge: usize,
    triangles: impl Iterator<Item = (u32, [[f64; 3]; 3])>,
    label: impl Fn(u32) -> u32,
    squared: &mut [f64],
    source: &mut [u32],
) -> u64 {
    // A voxel is a corner of several cells; the number of the last triangle that was measured from it spares the rest.
    let mut measured = vec![0_u32; edge * edge * edge];
    let mut distances = 0;
    for (number, (index, corners)) in (1..).zip(triangles) {
        let triangle = Triangle::new(corners);
        cut_cells(geometry, corners, part, |cell| {
            for corner in 0..8 {
                let voxel = [cell[0] + (corner & 1), cell[1] + (corner >> 1 & 1), cell[2] + (corner >> 2)];
                if !part.contains(voxel) {
                    continue;
                }
                let local: [usize; 3] = std::array::from_fn(|a| (voxel[a] - part.lo[a]) as usize);
                let place = (local[2] * edge + local[1]) * edge + local[0];
                if measured[place] == number {
                    continue;
                }
                measured[place] = number;
                distances += 1;
                let distance = triangle.distance_squared(geometry.position(voxel));
                if counts_before((distance, index), (squared[place], source[place]), &label) {
                    squared[place] = distance;
                    source[place] = index;
                }
            }
        });
    }
    distances
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::NO_SOURCE;
    use crate::kernel::distance::seeding::initialise;

    const EDGE: usize = 8;

    fn grid() -> Geometry {
        Geometry { shape: [8; 3], spacing: [0.5, 1.0, 0.25], origin: [-1.0, 2.0, 0.0], unit: None }
    }

    fn fixed(triangles: &[(u32, [[f64; 3]; 3])]) -> (Vec<f64>, Vec<u32>) {
        let (mut squared, mut source) = (vec![f64::INFINITY; EDGE.pow(3)], vec![NO_SOURCE; EDGE.pow(3)]);
        let all = Box3::from_shape([EDGE as i64; 3]);
        fix_voxels(&grid(), &all, EDGE, triangles.iter().copied(), |_| 1, &mut squared, &mut source);
        (squared, source)
    }

    #[test]
    fn a_triangle_of_equal_corners_fixes_what_a_point_does() {
        for point in [[0.3, 4.7, 0.9], [0.5, 5.0, 1.0], [-1.2, 3.0, 0.3], [2.5, 9.0, 1.75]] {
            let (mut squared, mut source) = (vec![f64::INFINITY; EDGE.pow(3)], vec![NO_SOURCE; EDGE.pow(3)]);
            let all = Box3::from_shape([EDGE as i64; 3]);
            initialise::fix_voxels(
                &grid(),
                &all,
                EDGE,
                [(7, point, initialise::Cube::CELL)].into_iter(),
                &mut squared,
                &mut source,
            );
            assert_eq!(fixed(&[(7, [point; 3])]), (squared, source), "{point:?}");
        }
    }

    #[test]
    fn a_triangle_in_a_grid_plane_fixes_its_points() {
        // In the plane of voxels z = 3.
        let (squared, source) = fixed(&[(0, [[-1.0, 2.0, 0.75], [1.5, 2.0, 0.75], [-1.0, 7.0, 0.75]])]);
        let at = |x: usize, y: usize, z: usize| (z * EDGE + y) * EDGE + x;
        assert_eq!((squared[at(0, 0, 3)], squared[at(2, 1, 3)], squared[at(0, 5, 3)]), (0.0, 0.0, 0.0));
        assert_eq!((squared[at(1, 1, 4)], source[at(1, 1, 4)]), (0.0625, 0));
        assert_eq!(source[at(1, 1, 2)], NO_SOURCE);
        assert_eq!(source[at(7, 7, 3)], NO_SOURCE);
    }

    #[test]
    fn ties_go_to_the_lower_index_in_any_order() {
        let shape = [[-0.9, 2.1, 0.1], [1.9, 2.2, 0.3], [0.0, 8.0, 1.5]];
        let flipped = [shape[1], shape[0], shape[2]];
        let far = shape.map(|[x, y, z]| [x, y, z + 0.3]);
        let ahead = fixed(&[(3, shape), (5, shape), (9, far)]);
        assert_eq!(ahead, fixed(&[(9, far), (5, shape), (3, shape)]));
        assert!(ahead.1.contains(&3) && !ahead.1.contains(&5) && ahead.1.contains(&9));
        assert!(fixed(&[(5, flipped), (3, shape)]).1.contains(&3));
    }

    #[test]
    fn a_part_gets_what_the_whole_gets() {
        let shape = [[-3.0, 1.0, -0.2], [2.9, 4.2, 0.3], [0.0, 12.0, 2.5]];
        let (squared, source) = fixed(&[(0, shape)]);
        let part = Box3::new([3, 2, 1], [7, 6, 5]);
        let (mut own, mut indices) = (vec![f64::INFINITY; 64], vec![NO_SOURCE; 64]);
        fix_voxels(&grid(), &part, 4, [(0, shape)].into_iter(), |_| 1, &mut own, &mut indices);
        let mut count = 0;
        for (y, z) in part.rows() {
            for x in part.lo[0]..part.hi[0] {
                let whole = ((z * 8 + y) * 8 + x) as usize;
                let place = part.offset_of([x, y, z]);
                assert_eq!((own[place], indices[place]), (squared[whole], source[whole]));
                count += usize::from(indices[place] == 0);
            }
        }
        assert!(count > 10);
    }
}
