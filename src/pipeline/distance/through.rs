//! A method of the Eikonal equation through a medium: before it relaxes a tile, the tile is given its speeds.

use super::medium::Medium;
use crate::grid::Box3;
use crate::kernel::distance::state::method::{DistanceMethod, DistanceState, OrderedSweeps, TakesSpeeds};
use crate::kernel::distance::state::neighbours::Neighbours;
use crate::tile::{HaloTile, TileCost};

/// A method, and what its front goes through.
pub(super) struct Through<'a, M> {
    pub(super) method: M,
    pub(super) medium: &'a Medium,
}

impl<M: DistanceState> DistanceState for Through<'_, M> {
    type State = M::State;
    const UNKNOWN: M::State = M::UNKNOWN;

    fn fixed(squared: f64, source: u32) -> M::State {
        M::fixed(squared, source)
    }

    fn is_fixed(state: M::State) -> bool {
        M::is_fixed(state)
    }

    fn entering(&self, beside: M::State, state: M::State, voxel: [i64; 3]) -> Option<f64> {
        self.method.entering(beside, state, voxel)
    }

    fn distance(&self, state: M::State, voxel: [i64; 3]) -> f64 {
        self.method.distance(state, voxel)
    }

    fn source(state: M::State) -> Option<u32> {
        M::source(state)
    }
}

impl<M: TakesSpeeds> DistanceMethod for Through<'_, M> {
    type Work = M::Work;

    fn work(edge: usize) -> M::Work {
        M::work(edge)
    }

    fn cost(edge: usize) -> TileCost {
        M::cost(edge)
    }

    fn settle(&self, tile: &mut HaloTile<M::State>, work: &mut M::Work, part: &Box3) -> bool {
        self.medium.put_of(part, M::speeds(work));
        self.method.settle(tile, work, part)
    }

    fn neighbours(&self) -> Neighbours {
        self.method.neighbours()
    }
}

impl<M: TakesSpeeds + OrderedSweeps> OrderedSweeps for Through<'_, M> {
    fn sweep(&self, tile: &mut HaloTile<M::State>, work: &mut M::Work, part: &Box3, upward: [bool; 3]) -> bool {
        self.medium.put_of(part, M::speeds(work));
        self.method.sweep(tile, work, part, upward)
    }
}
