//! VDT to points and triangles together (Kósa & Mikula 2023, Alg. 3 with Alg. 6; algorithms: sections 2 and 3).
//!
//! The state, its ties and its sweeps are those of `vector_distance`; only the distance to a source is another: exact
//! point–triangle distance (Eberly 1999), f64. It costs tens of additions, so a source is asked for its distance only
//! where a neighbour's differs from the kept one and from those just asked.

use super::directions::{CHANGED, Swept, sweep_until_quiet};
use super::initialise::{NO_SOURCE, squared_distance};
use super::method::{DistanceMethod, OrderedSweeps};
use super::vector_distance::FIXED;
use crate::grid::{Box3, DataSets, Geometry};
use crate::kernel::triangle::Triangle;
use crate::tile::HaloTile;

/// VDT to points and triangles.
#[derive(Clone, Debug)]
pub struct ShapeDistance<'a> {
    geometry: &'a Geometry,
    positions: &'a [[f64; 3]],
    triangles: Vec<Triangle>,
}

impl<'a> ShapeDistance<'a> {
    /// For sources in the world and a grid.
    #[must_use]
    pub fn new(geometry: &'a Geometry, sources: &'a DataSets) -> Self {
        let triangles = (0..sources.mesh.len()).map(|n| Triangle::new(sources.mesh.corners(n))).collect();
        Self { geometry, positions: &sources.positions, triangles }
    }

    /// The coordinate of a voxel's centre along an axis.
    pub(super) fn coordinate(&self, axis: usize, index: i64) -> f64 {
        self.geometry.origin[axis] + index as f64 * self.geometry.spacing[axis]
    }

    /// The squared distance of a world position to a source; infinite to none.
    pub(super) fn squared(&self, here: [f64; 3], source: u32) -> f64 {
        let source = (source & !FIXED) as usize;
        if let Some(&point) = self.positions.get(source) {
            return squared_distance(here, point);
        }
        let triangle = self.triangles.get(source - self.positions.len());
        triangle.map_or(f64::INFINITY, |triangle| triangle.distance_squared(here))
    }

    /// The nearest of the kept source and the six beside.
    fn nearest(&self, state: &[u32], at: usize, strides: [usize; 3], here: [f64; 3]) -> u32 {
        let mut best = (state[at], f64::NAN);
        let mut asked = [NO_SOURCE; 6];
        for side in 0..6 {
            let stride = strides[side / 2];
            let source = state[if side % 2 == 0 { at - stride } else { at + stride }] & !FIXED;
            if source == NO_SOURCE || source == best.0 || asked[..side].contains(&source) {
                continue;
            }
            asked[side] = source;
            if best.1.is_nan() {
                best.1 = self.squared(here, best.0);
            }
            let squared = self.squared(here, source);
            if squared < best.1 {
                best = (source, squared);
            }
        }
        best.0
    }

    fn pass(&self, tile: &mut HaloTile<u32>, part: &Box3, upward: [bool; 3]) -> Swept {
        let (valid, pitch) = (tile.valid(), tile.pitch());
        let strides = [1, pitch, pitch * pitch];
        let ordered = |axis: usize| {
            let count = valid[axis];
            (0..count).map(move |i| if upward[axis] { i } else { count - 1 - i })
        };
        let mut swept = 0;
        for z in ordered(2) {
            for y in ordered(1) {
                let row = tile.at(0, y as isize, z as isize);
                for x in ordered(0) {
                    let (at, state) = (row + x, tile.data_mut());
                    let kept = state[at];
                    if kept & FIXED != 0 {
                        continue;
                    }
                    let voxel = [part.lo[0] + x as i64, part.lo[1] + y as i64, part.lo[2] + z as i64];
                    state[at] = self.nearest(state, at, strides, self.geometry.position(voxel));
                    if state[at] != kept {
                        let first = [x, y, z].map(|n| n == 0);
                        let last: [bool; 3] = std::array::from_fn(|a| [x, y, z][a] + 1 == valid[a]);
                        let inside = std::array::from_fn(|a| if upward[a] { !first[a] } else { !last[a] });
                        swept |= CHANGED | self.carried_back(state, (at, voxel), strides, upward, inside);
                    }
                }
            }
        }
        swept
    }

    /// The axes along which the voxel that was passed before, `inside` the tile, is nearer to the source at place `at`
    /// than to its own.
    fn carried_back(
        &self,
        state: &[u32],
        (at, voxel): (usize, [i64; 3]),
        strides: [usize; 3],
        upward: [bool; 3],
        inside: [bool; 3],
    ) -> Swept {
        let is_nearer = |axis: usize| {
            let before = if upward[axis] { at - strides[axis] } else { at + strides[axis] };
            if !inside[axis] || state[before] & FIXED != 0 || state[before] == state[at] {
                return false;
            }
            let mut there = voxel;
            there[axis] += if upward[axis] { -1 } else { 1 };
            let there = self.geometry.position(there);
            self.squared(there, state[at]) < self.squared(there, state[before])
        };
        (0..3).map(|axis| u32::from(is_nearer(axis)) << axis).sum()
    }
}

impl DistanceMethod for ShapeDistance<'_> {
    type State = u32;
    type Work = ();
    const UNKNOWN: u32 = NO_SOURCE;

    fn fixed(_: f64, source: u32) -> u32 {
        source | FIXED
    }

    fn told(source: u32) -> Option<u32> {
        Some(source)
    }

    fn is_fixed(state: u32) -> bool {
        state & FIXED != 0
    }

    fn work(_: usize) {}

    fn settle(&self, tile: &mut HaloTile<u32>, (): &mut (), part: &Box3) -> bool {
        sweep_until_quiet([true; 3], |upward| self.pass(tile, part, upward))
    }

    fn entering(&self, beside: u32, state: u32, voxel: [i64; 3]) -> Option<f64> {
        if Self::is_fixed(state) || beside & !FIXED == state {
            return None;
        }
        let here = self.geometry.position(voxel);
        let entering = self.squared(here, beside);
        (entering < self.squared(here, state)).then(|| entering.sqrt())
    }

    fn distance(&self, state: u32, voxel: [i64; 3]) -> f64 {
        self.squared(self.geometry.position(voxel), state).sqrt()
    }

    fn source(state: u32) -> Option<u32> {
        Some(state & !FIXED).filter(|&s| s != NO_SOURCE)
    }
}

impl OrderedSweeps for ShapeDistance<'_> {
    fn sweep(&self, tile: &mut HaloTile<u32>, (): &mut (), part: &Box3, upward: [bool; 3]) -> bool {
        self.pass(tile, part, upward) & CHANGED != 0
    }
}
