//! VDT that looks at the sources of all 26 neighbours (Danielsson 1980; the papers went from 26 to 6: Kósa & Mikula
//! 2023).
//!
//! State, distances and ties are those of `vector_distance`; of equally near sources the first counts, z slowest. Rows
//! of a tile are swept one voxel after the other: what is beside a voxel across an edge may be ahead of it or behind,
//! so the tile is not laid out along diagonals, and its end depends on the sweeps' order where sources are lost. In
//! and out: a grown tile of source indices, the top bit set on fixed voxels. Halo 1, all 26 directions. No scratch.

use super::tracked::{CarriesSources, TrackedSource};
use crate::grid::{Box3, NEIGHBOURS_26, NO_SOURCE, SourceState};
use crate::kernel::distance::state::method::DistanceMethod;
use crate::kernel::distance::state::neighbours::Neighbours;
use crate::kernel::distance::state::precision::Real;
use crate::kernel::distance::tile_order::directions::{CHANGED, Swept, downhill, sweep_until_quiet};
use crate::tile::{HaloTile, TileCost};

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

    fn pass(&self, tile: &mut HaloTile<SourceState>, part: &Box3, upward: [bool; 3]) -> Swept {
        let (valid, pitch) = (tile.valid(), tile.pitch() as i64);
        let ordered = |axis: usize| {
            let count = valid[axis] as i64;
            (0..count).map(move |i| if upward[axis] { i } else { count - 1 - i })
        };
        let steps = NEIGHBOURS_26.map(|[x, y, z]| ((z * pitch + y) * pitch + x) as isize);
        let mut swept = 0;
        for z in ordered(2) {
            for y in ordered(1) {
                let row = tile.at(0, y as isize, z as isize);
                for x in ordered(0) {
                    let (at, state) = (row + x as usize, tile.data_mut());
                    let kept = state[at];
                    if kept.is_frozen() {
                        continue;
                    }
                    let voxel = [part.lo[0] + x, part.lo[1] + y, part.lo[2] + z];
                    state[at] = self.nearest(state, at, &steps, voxel);
                    if state[at] != kept {
                        swept |= CHANGED | self.carried_back(state, (at, voxel), &steps, part, upward);
                    }
                }
            }
        }
        swept
    }

    /// The nearest of the kept source and the 26 beside.
    fn nearest(&self, state: &[SourceState], at: usize, steps: &[isize; 26], voxel: [i64; 3]) -> SourceState {
        let here = self.position(voxel);
        let mut best = (state[at].source(), None);
        let mut last = best.0;
        for step in steps {
            let source = state[at.wrapping_add_signed(*step)].source();
            if source == NO_SOURCE || source == best.0 || source == last {
                continue;
            }
            last = source;
            let kept = best.1.unwrap_or_else(|| self.sources.squared(here, best.0));
            let squared = self.sources.squared(here, source);
            let nearer = self.sources.is_nearer((squared, source), (kept, best.0));
            best = if nearer { (source, Some(squared)) } else { (best.0, Some(kept)) };
        }
        SourceState::trial(best.0)
    }

    /// The axes along which a voxel of the tile that was passed before is nearer to the source at place `at` than to
    /// its own: of a neighbour's offset the slowest axis decides whether it was.
    fn carried_back(
        &self,
        state: &[SourceState],
        (at, voxel): (usize, [i64; 3]),
        steps: &[isize; 26],
        part: &Box3,
        upward: [bool; 3],
    ) -> Swept {
        let mut back = 0;
        for (step, offset) in steps.iter().zip(NEIGHBOURS_26) {
            let slowest = (0..3).rev().find(|&a| offset[a] != 0).unwrap_or(0);
            let there: [i64; 3] = std::array::from_fn(|a| voxel[a] + offset[a]);
            let own = state[at.wrapping_add_signed(*step)];
            let passed = (offset[slowest] < 0) == upward[slowest];
            if !passed || back >> slowest & 1 == 1 || !part.contains(there) || own.is_frozen() || own == state[at] {
                continue;
            }
            let there = self.position(there);
            let with_distance = |state: SourceState| (self.sources.squared(there, state.source()), state.source());
            let [entering, own] = [state[at], own].map(with_distance);
            back |= Swept::from(self.sources.is_nearer(entering, own)) << slowest;
        }
        back
    }

    fn position(&self, voxel: [i64; 3]) -> [S::Number; 3] {
        std::array::from_fn(|a| self.sources.coordinate(a, voxel[a]))
    }
}

impl<S: TrackedSource> CarriesSources for AllNeighbours<S> {
    type Sources = S;

    fn sources(&self) -> &S {
        &self.sources
    }
}

impl<S: TrackedSource> DistanceMethod for AllNeighbours<S> {
    type Work = ();

    fn work(_: usize) {}

    fn cost(edge: usize) -> TileCost {
        TileCost::grown(edge, 0)
    }

    fn settle(&self, tile: &mut HaloTile<SourceState>, (): &mut (), part: &Box3) -> bool {
        let first = downhill(tile, |at, state| {
            let here = self.position(std::array::from_fn(|a| part.lo[a] + at[a] as i64));
            self.sources.squared(here, state.source()).f64()
        });
        sweep_until_quiet(first, |upward| self.pass(tile, part, upward))
    }

    fn neighbours(&self) -> Neighbours {
        Neighbours::All
    }
}
