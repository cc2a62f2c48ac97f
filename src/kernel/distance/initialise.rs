//! Initialisation from a point cloud (Kósa & Mikula 2023, Alg. 1; algorithms: section 2).
//!
//! Each point fixes the eight grid points of the cell that holds it at their exact Euclidean distance; a grid point
//! keeps the smallest one and that source; of equal distances the lower source index wins, whatever the order in
//! which points arrive.

use crate::grid::{Box3, Geometry};

/// A voxel that no source fixes.
pub const NO_SOURCE: u32 = u32::MAX >> 1;

/// Fixes the voxels of `part` beside the given points.
///
/// `squared` holds squared distances (start: infinity), `source` the index of the fixing point (start:
/// [`NO_SOURCE`]); both dense `[z][y][x]` with room for `edge`^3 voxels from `part.lo` on. Positions are physical.
pub fn fix_voxels(
    geometry: &Geometry,
    part: &Box3,
    edge: usize,
    points: impl Iterator<Item = (u32, [f64; 3])>,
    squared: &mut [f64],
    source: &mut [u32],
) {
    for (index, position) in points {
        let at = geometry.to_voxels(position);
        let base = at.map(|v| v.floor() as i64);
        for corner in 0..8 {
            let voxel = [base[0] + (corner & 1), base[1] + (corner >> 1 & 1), base[2] + (corner >> 2)];
            if !part.contains(voxel) {
                continue;
            }
            let local: [usize; 3] = std::array::from_fn(|a| (voxel[a] - part.lo[a]) as usize);
            let place = (local[2] * edge + local[1]) * edge + local[0];
            let distance = squared_distance(geometry.position(voxel), position);
            let nearer = distance < squared[place] || (distance == squared[place] && index < source[place]);
            if nearer {
                squared[place] = distance;
                source[place] = index;
            }
        }
    }
}

/// The squared Euclidean distance of two positions.
#[inline]
#[must_use]
pub fn squared_distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let [x, y, z]: [f64; 3] = std::array::from_fn(|k| a[k] - b[k]);
    x * x + y * y + z * z
}
