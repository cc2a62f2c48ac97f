//! `VoxelTriangle`: which cells of a grid a triangle cuts (Akenine-Möller, Fast 3D Triangle-Box Overlap Testing, 2001,
//! doi:10.1080/10867651.2001.10487535).
//!
//! A cell is named by its lowest grid point and holds `[i, i + 1)` along each axis, so that a point lies in the cell of
//! its `floor`. A triangle and a box are apart when they are so along one of 13 axes: the three of the grid, which are
//! tested exactly and half-open, the triangle's normal, and the products of its sides with the grid's axes. The last
//! ten are tested with a margin for rounding: a cell that is cut is never missed, one that is only touched from
//! outside may be taken for cut. Triangles without area are segments or points by the same axes.

use glam::DVec3;

use super::{Box3, Geometry};

/// Rounding errors of a projection, in units of the sum of its terms' magnitudes.
const ROUNDING: f64 = 32.0 * f64::EPSILON;

/// Far beyond any grid, and far from the end of 64 bits.
const FARTHEST: f64 = (1_u64 << 60) as f64;

/// A triangle in voxel units, ready to be held against boxes of cells.
#[derive(Clone, Copy, Debug)]
pub struct VoxelTriangle {
    /// The first corner.
    anchor: [f64; 3],
    lo: [f64; 3],
    hi: [f64; 3],
    axes: [Axis; 10],
}

/// A direction, and the interval that the triangle covers along it as seen from its first corner.
#[derive(Clone, Copy, Debug, Default)]
struct Axis {
    direction: DVec3,
    /// Magnitudes of what was summed to get each component.
    size: DVec3,
    lo: f64,
    hi: f64,
    /// Rounding errors of `lo` and `hi`.
    margin: f64,
}

impl VoxelTriangle {
    /// The triangle with these corners, world positions, in the voxels of `geometry`.
    #[must_use]
    pub fn new(geometry: &Geometry, corners: [[f64; 3]; 3]) -> Self {
        let [a, b, c] = corners.map(|p| geometry.to_voxels(p));
        let lo = std::array::from_fn(|i| a[i].min(b[i]).min(c[i]));
        let hi = std::array::from_fn(|i| a[i].max(b[i]).max(c[i]));
        let [from, b, c] = [a, b, c].map(DVec3::from);
        let (ab, ac, bc) = (b - from, c - from, c - b);
        let mut axes = [Axis::default(); 10];
        axes[0] = Axis::of(product(ab, ac), [ab, ac]);
        for (n, side) in [ab, ac, bc].into_iter().enumerate() {
            for (a, unit) in DVec3::AXES.into_iter().enumerate() {
                axes[1 + 3 * n + a] = Axis::of(product(side, unit), [ab, ac]);
            }
        }
        Self { anchor: a, lo, hi, axes }
    }

    /// The smallest box of cells that holds the triangle.
    #[must_use]
    pub fn cells(&self) -> Box3 {
        let whole = |v: f64| v.floor().clamp(-FARTHEST, FARTHEST) as i64;
        Box3::new(self.lo.map(whole), self.hi.map(|v| whole(v) + 1))
    }

    /// The smallest box of voxels that holds all corners of the cells it lies in.
    #[must_use]
    pub fn voxels(&self) -> Box3 {
        let cells = self.cells();
        Box3::new(cells.lo, cells.hi.map(|v| v + 1))
    }

    /// True when the triangle cuts one of these cells.
    #[must_use]
    pub fn meets(&self, cells: &Box3) -> bool {
        let (lo, hi) = (cells.lo.map(|v| v as f64), cells.hi.map(|v| v as f64));
        if (0..3).any(|i| self.lo[i] >= hi[i] || self.hi[i] < lo[i]) {
            return false;
        }
        let half = (DVec3::from(hi) - DVec3::from(lo)) / 2.0;
        let centre = DVec3::from_array(std::array::from_fn(|i| f64::midpoint(lo[i], hi[i]) - self.anchor[i]));
        !self.axes.iter().any(|axis| axis.separates(centre, half))
    }
}

impl Axis {
    /// The axis along `direction`, for the triangle of these two sides from its first corner.
    fn of((direction, size): (DVec3, DVec3), sides: [DVec3; 2]) -> Self {
        let along = sides.map(|side| direction.dot(side));
        let margin = sides.map(|side| size.dot(side.abs()));
        Self {
            direction,
            size,
            lo: along[0].min(along[1]).min(0.0),
            hi: along[0].max(along[1]).max(0.0),
            margin: margin[0] + margin[1],
        }
    }

    /// True when a box and the triangle are apart along this axis beyond any rounding.
    fn separates(&self, centre: DVec3, half: DVec3) -> bool {
        let at = self.direction.dot(centre);
        let reach = self.direction.abs().dot(half);
        let margin = ROUNDING * (self.size.dot(centre.abs() + half) + self.margin);
        at - reach > self.hi + margin || at + reach < self.lo - margin
    }
}

/// The vector product and, component by component, the sum of its terms' magnitudes.
fn product(a: DVec3, b: DVec3) -> (DVec3, DVec3) {
    let terms = [(1, 2), (2, 0), (0, 1)].map(|(i, j)| (a[i] * b[j], a[j] * b[i]));
    (terms.map(|(p, q)| p - q).into(), terms.map(|(p, q)| p.abs() + q.abs()).into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn unit_grid() -> Geometry {
        Geometry { shape: [10; 3], spacing: [1.0; 3], origin: [0.0; 3], unit: None }
    }

    /// Whether anything of a triangle is left after it is clipped by the six sides of a box (Sutherland and Hodgman
    /// 1974): another way to the same answer, by points instead of axes.
    fn is_left(corners: [[f64; 3]; 3], lo: [f64; 3], hi: [f64; 3]) -> bool {
        let mut polygon = corners.to_vec();
        for axis in 0..3 {
            for (sign, limit) in [(1.0, hi[axis]), (-1.0, -lo[axis])] {
                let excess = |p: &[f64; 3]| sign * p[axis] - limit;
                let mut clipped = Vec::new();
                for (n, p) in polygon.iter().enumerate() {
                    let q = &polygon[(n + 1) % polygon.len()];
                    let (here, there) = (excess(p), excess(q));
                    if here <= 0.0 {
                        clipped.push(*p);
                    }
                    if (here < 0.0 && there > 0.0) || (here > 0.0 && there < 0.0) {
                        let t = here / (here - there);
                        clipped.push(std::array::from_fn(|i| p[i] + t * (q[i] - p[i])));
                    }
                }
                polygon = clipped;
            }
        }
        !polygon.is_empty()
    }

    fn corner() -> impl Strategy<Value = [f64; 3]> {
        prop::array::uniform3(prop_oneof![3 => 0.0..6.0_f64, 1 => (0..13).prop_map(|n| f64::from(n) / 2.0)])
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(512))]
        #[test]
        fn agrees_with_clipping(corners in prop::array::uniform3(corner()), thin in 0..4_u8) {
            let [a, b, mut c] = corners;
            if thin == 0 {
                c = std::array::from_fn(|i| f64::midpoint(a[i], b[i]));
            }
            let triangle = VoxelTriangle::new(&unit_grid(), [a, b, c]);
            for (y, z) in Box3::from_shape([7; 3]).rows() {
                for x in -1..7 {
                    let cell = Box3::new([x, y, z], [x + 1, y + 1, z + 1]);
                    let grown = |by: f64| is_left([a, b, c], cell.lo.map(|v| v as f64 - by), cell.hi.map(|v| v as f64 + by));
                    let meets = triangle.meets(&cell);
                    prop_assert!(meets || !grown(-1e-9), "missed {cell:?}");
                    prop_assert!(!meets || grown(1e-9), "not cut {cell:?}");
                    prop_assert!(!meets || !cell.intersect(&triangle.cells()).is_empty());
                }
            }
        }
    }

    #[test]
    fn cells_are_half_open() {
        let meets =
            |corners, lo: [i64; 3]| VoxelTriangle::new(&unit_grid(), corners).meets(&Box3::new(lo, lo.map(|v| v + 1)));
        let point = [[2.0, 3.5, 4.0]; 3];
        assert!(meets(point, [2, 3, 4]));
        assert!(!meets(point, [1, 3, 4]) && !meets(point, [2, 3, 3]) && !meets(point, [2, 2, 4]));
        // In the grid plane z = 4.
        let flat = [[0.5, 0.5, 4.0], [3.0, 0.5, 4.0], [0.5, 3.0, 4.0]];
        assert!(meets(flat, [1, 1, 4]) && !meets(flat, [1, 1, 3]) && !meets(flat, [2, 2, 4]));
        assert_eq!(VoxelTriangle::new(&unit_grid(), flat).cells(), Box3::new([0, 0, 4], [4, 4, 5]));
    }

    #[test]
    fn positions_beyond_all_numbers_stay_in_64_bits() {
        let huge = VoxelTriangle::new(&unit_grid(), [[-1e308; 3], [1e308; 3], [1e308, -1e308, 1e308]]);
        assert!(huge.cells().lo[0] < -(1 << 59) && huge.voxels().hi[0] > 1 << 59);
        assert!(huge.meets(&Box3::from_shape([9; 3])));
    }
}
