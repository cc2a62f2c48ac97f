//! What a distance method is to a schedule: a state for each voxel, and two ways to relax a tile of them.
//!
//! A new method is one file that implements [`DistanceMethod`] and one row in `pipeline::distance`'s table. What its states
//! are is [`DistanceState`], of which those that carry sources have one (`methods::tracked`).

use super::neighbours::Neighbours;
use crate::grid::Box3;
use crate::store::Element;
use crate::tile::{HaloTile, TileCost};

/// What a voxel holds, and what is read off it.
pub trait DistanceState: Send + Sync {
    /// What a brick keeps of each voxel.
    type State: Element;
    /// The state of a voxel of which nothing is known.
    const UNKNOWN: Self::State;

    /// The state of a voxel that `source` fixes at the given squared distance.
    fn fixed(squared: f64, source: u32) -> Self::State;

    /// The state of a voxel that is only told of a source near it, where the method keeps sources: it may learn of a
    /// nearer one.
    #[must_use]
    fn trial(_source: u32) -> Option<Self::State> {
        None
    }

    /// Whether a source fixed the voxel.
    fn is_fixed(state: Self::State) -> bool;

    /// Whether a voxel at `voxel`, whose state is `state`, may fall beside one in state `beside`; the value that would
    /// enter it: what the front schedule orders bricks by.
    fn entering(&self, beside: Self::State, state: Self::State, voxel: [i64; 3]) -> Option<f64>;

    /// The distance of a voxel, physical units; infinite where nothing is known.
    fn distance(&self, state: Self::State, voxel: [i64; 3]) -> f64;

    /// The squared distance of a voxel, physical units; where the method keeps sources [`DistanceState::distance`] is its
    /// root.
    fn distance_squared(&self, state: Self::State, voxel: [i64; 3]) -> f64 {
        self.distance(state, voxel).powi(2)
    }

    /// The voxel's source, where the method keeps it and one is known.
    fn source(state: Self::State) -> Option<u32>;
}

/// A way to carry distance from fixed voxels outward. Values only ever fall; fixed voxels keep what they
/// start with.
pub trait DistanceMethod: DistanceState {
    /// Buffers of one thread.
    type Work: Send + 'static;

    /// Buffers for tiles of `edge`^3 voxels.
    fn work(edge: usize) -> Self::Work;

    /// What a thread takes for tiles of `edge`^3 voxels: the halo that is read, and those buffers.
    fn cost(edge: usize) -> TileCost;

    /// Relaxes a tile, whose lowest voxel lies at `part.lo`, until no voxel of it can fall. Halo 1.
    /// Returns whether any voxel changed.
    fn settle(&self, tile: &mut HaloTile<Self::State>, work: &mut Self::Work, part: &Box3) -> bool;

    /// Which neighbours a voxel's state is made of: what wakes a brick, and how wide its halo is.
    fn neighbours(&self) -> Neighbours {
        Neighbours::Faces
    }
}

/// A method of ordered sweeps over the whole domain.
pub trait OrderedSweeps: DistanceMethod {
    /// One ordered pass over a tile. Tiles taken in sweep order give bit for bit what the triple loop over the domain
    /// gives. Returns whether any voxel changed.
    fn sweep(&self, tile: &mut HaloTile<Self::State>, work: &mut Self::Work, part: &Box3, upward: [bool; 3]) -> bool;
}

/// A method that can be told how fast a front passes each voxel of a tile: its values are then times.
pub trait TakesSpeeds: DistanceMethod {
    /// Where the speeds of the tile that is relaxed next go; its ghosts need none.
    fn speeds(work: &mut Self::Work) -> &mut HaloTile<f32>;
}
