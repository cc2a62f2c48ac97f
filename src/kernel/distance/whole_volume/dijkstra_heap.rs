//! DP over a whole volume in memory, in the textbook's order (Kósa & Mikula 2023, Alg. 5 as mended; docs/algorithms.md,
//! "Dijkstra-Pythagoras").
//!
//! One heap: the smallest voxel takes the nearest of the sources of its frozen neighbours, of equally near ones that
//! of the lower label where triangles are among them, then the first of -x, +x, -y, +y, -z, +z (of 26: z slowest), and
//! is frozen at the exact distance d to it. To neighbours that are not frozen it offers d and the way to them: an upper
//! bound, by which the heap is ordered. Fixed voxels are on trial from the beginning. In and out: dense `[z][y][x]`
//! states, the top bit set on fixed voxels. All in f64.
//!
//! A voxel is never looked at again, so it may miss a source that a neighbour frozen later has: the front of bricks
//! (`dijkstra_pythagoras`) finds that one.

use super::wavefront::Wavefront;
use crate::grid::Geometry;
use crate::grid::{NO_SOURCE, SourceState};
use crate::kernel::distance::methods::tracked::TrackedSource;
use crate::kernel::distance::state::neighbours::Neighbours;

/// Bytes of a voxel beside its state: its bound, whether it is frozen, and its entries in the heap.
pub const SCRATCH_BYTES: u64 = 33;

/// A march under way.
#[derive(Debug)]
pub struct DijkstraHeap<'a, S> {
    front: Wavefront,
    method: &'a S,
    states: &'a mut [SourceState],
    bounds: Vec<f64>,
    /// Steps to neighbours and their lengths.
    steps: Vec<([i64; 3], f64)>,
}

impl<'a, S: TrackedSource<Number = f64>> DijkstraHeap<'a, S> {
    /// Ready to start from the fixed voxels among `states`; no other has a source.
    #[must_use]
    pub fn new(geometry: &Geometry, method: &'a S, neighbours: Neighbours, states: &'a mut [SourceState]) -> Self {
        let mut front = Wavefront::new(geometry.shape);
        let mut bounds = vec![f64::INFINITY; states.len()];
        for (place, &state) in states.iter().enumerate().filter(|(_, state)| state.is_frozen()) {
            bounds[place] = method.distance(state, front.voxel(place));
            front.push(place, bounds[place]);
        }
        let steps = neighbours.offsets().into_iter().map(|offset| (offset, geometry.length(offset))).collect();
        Self { front, method, states, bounds, steps }
    }

    /// Freezes up to `count` voxels; false when all that can be reached are frozen.
    pub fn advance(&mut self, count: usize) -> bool {
        for _ in 0..count {
            let Some(place) = self.front.freeze() else { return false };
            let voxel = self.front.voxel(place);
            let distance = if self.states[place].is_frozen() {
                self.bounds[place]
            } else {
                let (source, squared) = self.nearest(voxel);
                self.states[place] = SourceState::trial(source);
                squared.sqrt()
            };
            self.offer(voxel, distance);
        }
        true
    }

    /// The nearest source of the frozen neighbours, and its squared distance.
    fn nearest(&self, voxel: [i64; 3]) -> (u32, f64) {
        let here = std::array::from_fn(|a| self.method.coordinate(a, voxel[a]));
        let mut best = (NO_SOURCE, f64::INFINITY);
        for (offset, _) in &self.steps {
            let beside = self.front.beside(voxel, *offset).filter(|&beside| self.front.is_frozen(beside));
            let source = beside.map_or(NO_SOURCE, |beside| self.states[beside].source());
            if source != NO_SOURCE && source != best.0 {
                let squared = self.method.squared(here, source);
                if self.method.is_nearer((squared, source), (best.1, best.0)) {
                    best = (source, squared);
                }
            }
        }
        best
    }

    fn offer(&mut self, voxel: [i64; 3], distance: f64) {
        for (offset, step) in &self.steps {
            let Some(beside) = self.front.beside(voxel, *offset) else { continue };
            let bound = distance + step;
            if !self.states[beside].is_frozen() && !self.front.is_frozen(beside) && bound < self.bounds[beside] {
                self.bounds[beside] = bound;
                self.front.push(beside, bound);
            }
        }
    }
}
