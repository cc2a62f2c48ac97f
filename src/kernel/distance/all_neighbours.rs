//! VDT that looks at the sources of all 26 neighbours (Danielsson 1980; the papers went from 26 to 6: Kósa & Mikula 2023).
//!
//! State, distances and ties are those of `vector_distance`; of equally near sources the first counts, z slowest. Rows
//! of a tile are swept one voxel after the other: what is beside a voxel across an edge may be ahead of it or behind,
//! so the tile is not laid out along diagonals, and its end depends on the sweeps' order where sources are lost. In
//! and out: a grown tile of source indices, the top bit set on fixed voxels. Halo 1, all 26 directions. No scratch.

use super::Neighbours;
use super::directions::{Sides, sweep_until_quiet};
use super::method::DistanceMethod;
use super::tracked::{TrackedSource, has_source, source_of};
use crate::grid::{Box3, NEIGHBOURS_26};
use crate::tile::HaloTile;

/// VDT with 26 neighbours to the sources of `S`.
#[derive(Clone, Debug)]
pub struct AllNeighbours<S> {
    sources: S,
}

impl<S: TrackedSource> AllNeighbours<S> {
    /// To those sources.
    #[must_use]
    pub fn new(sources: S) -> Self {
        Self { sources }
    }

    fn pass(&self, tile: &mut HaloTile<u32>, part: &Box3, upward: [bool; 3]) -> Sides {
        let (valid, pitch) = (tile.valid(), tile.pitch() as i64);
        let ordered = |axis: usize| {
            let count = valid[axis] as i64;
            (0..count).map(move |i| if upward[axis] { i } else { count - 1 - i })
        };
        let steps = NEIGHBOURS_26.map(|[x, y, z]| ((z * pitch + y) * pitch + x) as isize);
        let mut sides = 0;
        for z in ordered(2) {
            for y in ordered(1) {
                let row = tile.at(0, y as isize, z as isize);
                for x in ordered(0) {
                    let at = row + x as usize;
                    if S::is_fixed(tile.data()[at]) {
                        continue;
                    }
                    let voxel = [part.lo[0] + x, part.lo[1] + y, part.lo[2] + z];
                    let (source, side) = self.nearest(tile.data(), at, &steps, voxel);
                    if side != 0 {
                        tile.data_mut()[at] = source;
                        sides |= side;
                    }
                }
            }
        }
        sides
    }

    /// The nearest of the kept source and the 26 beside, and the sides it came through.
    fn nearest(&self, state: &[u32], at: usize, steps: &[isize; 26], voxel: [i64; 3]) -> (u32, Sides) {
        let here = std::array::from_fn(|a| self.sources.coordinate(a, voxel[a]));
        let mut best = (state[at], None, 0);
        let mut last = state[at];
        for (step, offset) in steps.iter().zip(NEIGHBOURS_26) {
            let source = source_of(state[at.wrapping_add_signed(*step)]);
            if !has_source(source) || source == best.0 || source == last {
                continue;
            }
            last = source;
            let kept = best.1.unwrap_or_else(|| self.sources.squared(here, best.0));
            let squared = self.sources.squared(here, source);
            best = if squared < kept { (source, Some(squared), sides(offset)) } else { (best.0, Some(kept), best.2) };
        }
        (best.0, best.2)
    }
}

/// The sides of a voxel that a step leads through.
fn sides(offset: [i64; 3]) -> Sides {
    (0..3).fold(0, |sides, a| sides | Sides::from(offset[a] < 0) << (2 * a) | Sides::from(offset[a] > 0) << (2 * a + 1))
}

impl<S: TrackedSource> DistanceMethod for AllNeighbours<S> {
    type State = u32;
    type Work = ();
    const UNKNOWN: u32 = S::UNKNOWN;

    fn fixed(squared: f64, source: u32) -> u32 {
        S::fixed(squared, source)
    }

    fn is_fixed(state: u32) -> bool {
        S::is_fixed(state)
    }

    fn work(_: usize) {}

    fn settle(&self, tile: &mut HaloTile<u32>, (): &mut (), part: &Box3) -> bool {
        sweep_until_quiet([true; 3], |upward| self.pass(tile, part, upward))
    }

    fn neighbours(&self) -> Neighbours {
        Neighbours::All
    }

    fn entering(&self, beside: u32, state: u32, voxel: [i64; 3]) -> Option<f64> {
        self.sources.entering(beside, state, voxel)
    }

    fn distance(&self, state: u32, voxel: [i64; 3]) -> f64 {
        self.sources.distance(state, voxel)
    }

    fn source(state: u32) -> Option<u32> {
        S::source(state)
    }
}
