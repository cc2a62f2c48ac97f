//! DP, the Dijkstra-Pythagoras method (Kósa & Mikula 2023, Alg. 5; docs/algorithms.md, "Dijkstra-Pythagoras") inside a
//! tile.
//!
//! State, distances and ties are those of VDT; only the order is another. What enters a tile, from ghosts and fixed
//! voxels, is carried through it in order of exact distance: a voxel offers its source to its neighbours, which keep
//! it where it is nearer than theirs. A voxel whose nearest source arrives late takes it up again: the march ends when
//! no neighbour of a voxel has a nearer source. Over scattered points fewer than one voxel in 1000 is farther from its
//! source than from the nearest point, by less than 0.1 h; in the textbook's heap (`dijkstra_heap`), which looks at a
//! voxel once, by less than 0.25 h (tests: `wavefront`). In and out: a grown tile of source indices, the top bit set
//! on voxels that a source fixed. Halo 1: faces, or all of it where sources are offered to all 26 neighbours. Scratch:
//! about 20 bytes a voxel. A voxel asks for about five distances.

use super::tracked::{CarriesSources, TrackedSource};
use crate::grid::{Box3, Geometry, NEIGHBOURS_26, SourceState};
use crate::kernel::distance::state::method::DistanceMethod;
use crate::kernel::distance::state::neighbours::Neighbours;
use crate::kernel::distance::state::precision::Real;
use crate::kernel::distance::tile_order::buckets::{Buckets, LISTED_BYTES, QUEUE_BYTES};
use crate::tile::{HaloTile, TileCost};

/// Width of a bucket, in the smallest spacing.
const WIDTH: f64 = 0.5;

/// DP to the sources of `S`.
#[derive(Clone, Debug)]
pub struct DijkstraPythagoras<S> {
    sources: S,
    spacing: [f64; 3],
    neighbours: Neighbours,
}

impl<S: TrackedSource> DijkstraPythagoras<S> {
    /// To those sources on a grid, offered to those neighbours.
    #[must_use]
    pub fn new(geometry: &Geometry, neighbours: Neighbours, sources: S) -> Self {
        Self { sources, spacing: geometry.spacing, neighbours }
    }
}

/// A tile and its queue.
#[derive(Debug)]
pub struct Work<A> {
    pitch: usize,
    valid: [usize; 3],
    neighbours: Neighbours,
    /// The grown tile; ghosts count as fixed.
    source: Vec<SourceState>,
    /// Squared distances to the sources; below zero where nobody asked yet.
    squared: Vec<A>,
    /// Coordinates of voxels along the axes, by index from the lower ghost.
    at: [Vec<A>; 3],
    queue: Buckets<A>,
    fallen: Vec<u32>,
    taken: Vec<u32>,
}

impl<A: Real> Work<A> {
    fn new(edge: usize) -> Self {
        let pitch = edge + 2;
        let len = pitch.pow(3);
        Self {
            pitch,
            valid: [edge; 3],
            neighbours: Neighbours::Faces,
            source: vec![SourceState::FAR.freeze(); len],
            squared: vec![A::default(); len],
            at: std::array::from_fn(|_| vec![A::default(); pitch]),
            queue: Buckets::new(len),
            fallen: Vec::new(),
            taken: Vec::new(),
        }
    }

    fn load<S: TrackedSource<Number = A>>(&mut self, sources: &S, tile: &HaloTile<SourceState>, part: &Box3) {
        self.source.copy_from_slice(tile.data());
        self.squared.fill(A::of(-1.0));
        let (valid, pitch) = (tile.valid(), self.pitch);
        self.valid = valid;
        let strides = [1, pitch, pitch * pitch];
        for axis in 0..3 {
            for n in 0..pitch {
                self.at[axis][n] = sources.coordinate(axis, part.lo[axis] + n as i64 - 1);
            }
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for layer in [0, valid[axis] + 1] {
                for j in 0..valid[v] + 2 {
                    for i in 0..valid[u] + 2 {
                        let ghost = &mut self.source[i * strides[u] + j * strides[v] + layer * strides[axis]];
                        *ghost = ghost.freeze();
                    }
                }
            }
        }
    }

    fn store(&self, tile: &mut HaloTile<SourceState>) {
        let ([nx, ny, nz], pitch) = (tile.valid(), self.pitch);
        for z in 1..=nz {
            for y in 1..=ny {
                let row = (z * pitch + y) * pitch + 1;
                tile.data_mut()[row..][..nx].copy_from_slice(&self.source[row..][..nx]);
            }
        }
    }

    /// Offers the source of `from` to the voxel `at`.
    #[inline(always)]
    fn offer<S: TrackedSource<Number = A>>(&mut self, sources: &S, from: usize, at: [usize; 3]) {
        let place = (at[2] * self.pitch + at[1]) * self.pitch + at[0];
        let (source, state) = (self.source[from].source(), self.source[place]);
        let kept = state.source();
        if state.is_frozen() || kept == source {
            return;
        }
        let here = [self.at[0][at[0]], self.at[1][at[1]], self.at[2][at[2]]];
        if self.squared[place].is_marked() {
            self.squared[place] = sources.squared(here, kept);
        }
        let squared = sources.squared(here, source);
        if sources.is_nearer((squared, source), (self.squared[place], kept)) {
            self.squared[place] = squared;
            self.source[place] = SourceState::trial(source);
            self.fallen.push(place as u32);
        }
    }

    /// Offers a voxel's source to its neighbours in the tile.
    #[inline(always)]
    fn offer_around<S: TrackedSource<Number = A>>(&mut self, sources: &S, [x, y, z]: [usize; 3]) {
        if self.neighbours == Neighbours::All {
            return self.offer_to_all(sources, [x, y, z]);
        }
        let place = (z * self.pitch + y) * self.pitch + x;
        self.offer(sources, place, [x - 1, y, z]);
        self.offer(sources, place, [x + 1, y, z]);
        self.offer(sources, place, [x, y - 1, z]);
        self.offer(sources, place, [x, y + 1, z]);
        self.offer(sources, place, [x, y, z - 1]);
        self.offer(sources, place, [x, y, z + 1]);
    }

    /// Offers the source of a voxel or ghost to those of its 26 neighbours that lie in the tile.
    fn offer_to_all<S: TrackedSource<Number = A>>(&mut self, sources: &S, at: [usize; 3]) {
        let place = (at[2] * self.pitch + at[1]) * self.pitch + at[0];
        for offset in NEIGHBOURS_26 {
            let beside: [usize; 3] = std::array::from_fn(|a| at[a].wrapping_add_signed(offset[a] as isize));
            if (0..3).all(|a| (1..=self.valid[a]).contains(&beside[a])) {
                self.offer(sources, place, beside);
            }
        }
    }

    /// Offers what ghosts have across edges and corners too.
    fn offer_all_ghosts<S: TrackedSource<Number = A>>(&mut self, sources: &S) {
        let valid = self.valid;
        for z in 0..valid[2] + 2 {
            for y in 0..valid[1] + 2 {
                let inside = (1..=valid[1]).contains(&y) && (1..=valid[2]).contains(&z);
                let step = if inside { valid[0] + 1 } else { 1 };
                for x in (0..valid[0] + 2).step_by(step) {
                    if self.source[(z * self.pitch + y) * self.pitch + x].has_source() {
                        self.offer_to_all(sources, [x, y, z]);
                    }
                }
            }
        }
    }

    /// Offers what ghosts and voxels with a source have.
    fn offer_known<S: TrackedSource<Number = A>>(&mut self, sources: &S) {
        let valid = self.valid;
        let strides = [1, self.pitch, self.pitch * self.pitch];
        for z in 1..=valid[2] {
            for y in 1..=valid[1] {
                let row = z * strides[2] + y * strides[1];
                for x in 1..=valid[0] {
                    if self.source[row + x].has_source() {
                        self.offer_around(sources, [x, y, z]);
                    }
                }
            }
        }
        if self.neighbours == Neighbours::All {
            return self.offer_all_ghosts(sources);
        }
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for (layer, inner) in [(0, 1), (valid[axis] + 1, valid[axis])] {
                for j in 1..=valid[v] {
                    for i in 1..=valid[u] {
                        let ghost = i * strides[u] + j * strides[v] + layer * strides[axis];
                        if self.source[ghost].has_source() {
                            let mut at = [inner; 3];
                            (at[u], at[v]) = (i, j);
                            self.offer(sources, ghost, at);
                        }
                    }
                }
            }
        }
    }

    /// Carries sources on from the voxels that changed until none changes; returns whether any did.
    fn march<S: TrackedSource<Number = A>>(&mut self, sources: &S, width: f64, range: f64) -> bool {
        if self.fallen.is_empty() {
            return false;
        }
        let least = |least: A, &place: &u32| least.smaller(self.squared[place as usize]);
        let least = self.fallen.iter().fold(A::INFINITY, least).root();
        self.queue.start(least, width, range);
        loop {
            for place in self.fallen.drain(..) {
                self.queue.push(place, self.squared[place as usize].root());
            }
            let mut taken = std::mem::take(&mut self.taken);
            let more = self.queue.take(&mut taken);
            for &place in &taken {
                let (row, pitch) = (place / self.pitch as u32, self.pitch as u32);
                self.offer_around(sources, [place % pitch, row % pitch, row / pitch].map(|n| n as usize));
            }
            self.taken = taken;
            if !more {
                return true;
            }
        }
    }
}

impl<S: TrackedSource> CarriesSources for DijkstraPythagoras<S> {
    type Sources = S;

    fn sources(&self) -> &S {
        &self.sources
    }
}

impl<S: TrackedSource> DistanceMethod for DijkstraPythagoras<S> {
    type Work = Work<S::Number>;

    fn work(edge: usize) -> Self::Work {
        Work::new(edge)
    }

    fn cost(edge: usize) -> TileCost {
        // Sources and squared distances; the places that fell and those that are taken.
        let lists = 2 * LISTED_BYTES;
        TileCost::grown(edge, (size_of::<SourceState>() + size_of::<S::Number>()) as u64 + QUEUE_BYTES + lists)
    }

    fn settle(&self, tile: &mut HaloTile<SourceState>, work: &mut Self::Work, part: &Box3) -> bool {
        let valid = tile.valid();
        work.load(&self.sources, tile, part);
        work.neighbours = self.neighbours;
        work.offer_known(&self.sources);
        let width = WIDTH * self.spacing.iter().copied().fold(f64::INFINITY, f64::min);
        let range = (0..3).map(|a| self.spacing[a] * valid[a] as f64).sum();
        let changed = work.march(&self.sources, width, range);
        if changed {
            work.store(tile);
        }
        changed
    }

    fn neighbours(&self) -> Neighbours {
        self.neighbours
    }
}
