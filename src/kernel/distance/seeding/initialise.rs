//! Initialisation from a point cloud (Kósa & Mikula 2023, Alg. 1 and section 4.0.1; docs/algorithms.md, "Points").
//!
//! Each point fixes the eight grid points of the cell that holds it, or of a larger cube around that cell, at their
//! exact Euclidean distance; a point that lies on a grid point may fix that one alone. A grid point keeps the smallest
//! one and that source; of equal distances the lower source index wins, whatever the order in which points arrive.

use crate::grid::{Box3, Geometry};
use crate::kernel::distance::state::source::squared_distance;

/// Which voxels a point fixes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cube {
    /// Voxels by which the cube is larger than the point's cell, on every side, along each axis.
    pub margin: [i64; 3],
    /// Whether a point within 1e-9 voxels of a grid point fixes that one alone.
    pub snaps: bool,
}

impl Cube {
    /// The corners of the point's cell (Alg. 1).
    pub const CELL: Self = Self { margin: [0; 3], snaps: false };

    /// So many voxels larger on every side, along each axis; a point on a grid point counts as one in the cell above
    /// it.
    #[must_use]
    pub fn grown(self, voxels: [i64; 3]) -> Self {
        if voxels == [0; 3] {
            return self;
        }
        Self { margin: std::array::from_fn(|a| self.margin[a] + voxels[a]), snaps: false }
    }

    /// The voxels that a point at `at`, in voxel units, fixes.
    fn voxels(self, at: [f64; 3]) -> Box3 {
        let nearest = at.map(f64::round);
        if self.snaps && (0..3).all(|a| (at[a] - nearest[a]).abs() <= 1e-9) {
            return Box3::new(nearest.map(|v| v as i64), nearest.map(|v| v as i64 + 1));
        }
        let base = at.map(|v| v.floor() as i64);
        Box3 {
            lo: std::array::from_fn(|a| base[a] - self.margin[a]),
            hi: std::array::from_fn(|a| base[a] + 2 + self.margin[a]),
        }
    }
}

/// Fixes the voxels of `part` that the given points fix, each with its index and the cube around it.
///
/// `squared` holds squared distances (start: infinity), `source` the index of the fixing point (start:
/// `NO_SOURCE`); both dense `[z][y][x]` with room for `edge`^3 voxels from `part.lo` on. Positions are physical.
pub fn fix_voxels(
    geometry: &Geometry,
    part: &Box3,
    edge: usize,
    points: impl Iterator<Item = (u32, [f64; 3], Cube)>,
    squared: &mut [f64],
    source: &mut [u32],
) {
    for (index, position, cube) in points {
        let voxels = cube.voxels(geometry.to_voxels(position)).intersect(part);
        for (y, z) in voxels.rows() {
            let row = ((z - part.lo[2]) as usize * edge + (y - part.lo[1]) as usize) * edge;
            for x in voxels.lo[0]..voxels.hi[0] {
                let place = row + (x - part.lo[0]) as usize;
                let distance = squared_distance(geometry.position([x, y, z]), position);
                let nearer = distance < squared[place] || (distance == squared[place] && index < source[place]);
                if nearer {
                    squared[place] = distance;
                    source[place] = index;
                }
            }
        }
    }
}
