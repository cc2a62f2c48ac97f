//! Sources for finished distances, tile by tile: each voxel has a *parent* (`parents`), and its source is the one of
//! the fixed voxel at the end of the chain of parents.
//!
//! Here chains are followed inside a tile, to voxels and ghosts whose source is known. In: grown tiles of distances
//! (sign bit on fixed voxels) and of source states. Out: the states. Halo 1, all 26 directions. Scratch: a few bytes a
//! voxel. What is found does not depend on the order in which tiles come. Where data sets have labels, a voxel with
//! several parents that are as good waits for the sources of all, and takes that of the lowest label; of equal ones the
//! first.
//!
//! Where distances are so large that a step is lost in rounding, neighbours are equal, and a voxel may have no parent.
//! Such voxels, and those whose chains lead to them, are *filled* in the end: among the sources that reach one through
//! such voxels, on a way on which distances never fall, it gets the lowest.

use super::parents::{Parent, Parents};
use crate::grid::{DataSets, Geometry, NO_SOURCE, SourceState};
use crate::kernel::distance::state::precision::{Precision, Real};
use crate::tile::HaloTile;

/// Finds sources in tiles of one size.
#[derive(Clone, Debug)]
pub struct Tracer<R> {
    parents: R,
    /// Places at which rows start that hold voxels without a source.
    rows: Vec<usize>,
    /// Whether a voxel's chain was followed in this tile, or ends there.
    followed: Vec<bool>,
    /// Places on the way, and whether each has several parents.
    chain: Vec<(usize, bool)>,
    equals: Vec<usize>,
}

impl<R: Parents> Tracer<R> {
    /// For tiles of `edge`^3 voxels of a grid.
    #[must_use]
    pub fn new(geometry: &Geometry, edge: usize) -> Self {
        let (followed, parents) = (vec![true; (edge + 2).pow(3)], R::new(geometry, edge));
        Self { parents, rows: Vec::new(), followed, chain: Vec::new(), equals: Vec::new() }
    }

    /// Gives voxels their sources where the chain ends at a known one. Returns whether any got one, and whether any
    /// that has a distance is left without. With the data sets, where their labels are wanted; with speeds, where voxels
    /// have these.
    pub fn trace<P: Precision>(
        &mut self,
        labelled: Option<&DataSets>,
        (distance, speeds): (&HaloTile<P>, Option<&HaloTile<f32>>),
        state: &mut HaloTile<SourceState>,
    ) -> (bool, bool) {
        let ([nx, ny, nz], pitch) = (distance.valid(), distance.pitch());
        let rows = (1..=nz).flat_map(|z| (1..=ny).map(move |y| (z * pitch + y) * pitch + 1));
        self.rows.clear();
        self.rows.extend(rows.filter(|&row| lacks(&state.data()[row..][..nx])));
        self.parents.find(distance, speeds, &self.rows);
        for &row in &self.rows {
            self.followed[row..][..nx].fill(false);
        }
        let (mut found, mut left) = (false, false);
        for n in 0..self.rows.len() {
            let row = self.rows[n];
            for place in row..row + nx {
                if !state.data()[place].has_source() && distance.data()[place].lane() < P::Lane::INFINITY {
                    let known = self.follow(labelled, distance.data(), state.data_mut(), place);
                    found |= known;
                    left |= !known;
                }
            }
        }
        // Chains end at ghosts, and in rows that have all sources.
        for &row in &self.rows {
            self.followed[row..][..nx].fill(true);
        }
        (found, left)
    }

    /// Follows the chain from a voxel; all voxels on it get the source at its end, if that is known.
    fn follow<P: Precision>(
        &mut self,
        labelled: Option<&DataSets>,
        distance: &[P],
        state: &mut [SourceState],
        from: usize,
    ) -> bool {
        if self.followed[from] {
            return false;
        }
        let parent = |tracer: &Self, at: usize| {
            let parent = tracer.parents.parent(distance, at);
            parent.map(|parent| Parent { is_tied: parent.is_tied && labelled.is_some(), ..parent })
        };
        let first = parent(self, from);
        if let Some(parent) = first.filter(|parent| !parent.is_tied && state[parent.place].has_source()) {
            state[from] = state[parent.place].thaw();
            return true;
        }
        self.chain.clear();
        let mut next = self.enter(from, first);
        loop {
            let mut source = NO_SOURCE;
            while let Some(at) = next {
                source = state[at].source();
                if source != NO_SOURCE || self.followed[at] {
                    break;
                }
                next = self.enter(at, parent(self, at));
            }
            next = self.leave(labelled, distance, state, source);
            if next.is_none() {
                return state[from].has_source();
            }
        }
    }

    /// Takes a voxel into the chain; where that goes on.
    fn enter(&mut self, at: usize, parent: Option<Parent>) -> Option<usize> {
        self.followed[at] = true;
        self.chain.push((at, parent.is_some_and(|parent| parent.is_tied)));
        parent.map(|parent| parent.place)
    }

    /// Gives the voxels of the chain, from its end on, a source; up to one with several parents of which another is to
    /// be followed first.
    fn leave<P: Precision>(
        &mut self,
        labelled: Option<&DataSets>,
        distance: &[P],
        state: &mut [SourceState],
        mut source: u32,
    ) -> Option<usize> {
        while let Some((at, is_tied)) = self.chain.pop() {
            if let Some(sets) = labelled.filter(|_| is_tied) {
                self.parents.equals(distance, at, &mut self.equals);
                let is_unknown = |place: &&usize| !state[**place].has_source();
                if let Some(&other) = self.equals.iter().find(|place| is_unknown(place) && !self.followed[**place]) {
                    self.chain.push((at, true));
                    return Some(other);
                }
                let all = self.equals.iter().map(|&place| state[place].source());
                let is_known = !self.equals.iter().any(|place| is_unknown(&place));
                source = all.filter(|_| is_known).min_by_key(|&source| sets.label(source)).unwrap_or(NO_SOURCE);
            }
            state[at] = SourceState::trial(source);
        }
        None
    }
}

/// Whether any of these voxels has no source.
fn lacks(states: &[SourceState]) -> bool {
    states.iter().fold(false, |any, state| any | !state.has_source())
}

/// Fills voxels that tracing left without a source, as far as that is known in this tile. While it goes on their states
/// are frozen like those of fixed voxels, whose distances have a sign: they may still fall. Returns whether any state changed,
/// and whether the tile has such voxels.
pub fn fill<P: Precision>(distance: &HaloTile<P>, state: &mut HaloTile<SourceState>) -> (bool, bool) {
    let ([nx, ny, nz], pitch) = (distance.valid(), distance.pitch());
    let values = distance.data();
    let steps = [1, pitch as isize, (pitch * pitch) as isize].map(|step| [-step, step]);
    let (mut changed, mut filled) = (false, false);
    loop {
        let mut falls = false;
        for place in
            (1..=nz).flat_map(|z| (1..=ny).flat_map(move |y| (1..=nx).map(move |x| (z * pitch + y) * pitch + x)))
        {
            let (here, kept) = (values[place].lane(), state.data()[place]);
            let is_filled = kept == SourceState::FAR || kept.is_frozen();
            let has_distance = here < P::Lane::INFINITY && !here.is_marked();
            if !(has_distance && is_filled) {
                continue;
            }
            filled = true;
            let beside = steps.as_flattened().iter().map(|&step| place.wrapping_add_signed(step));
            let told = beside.filter(|&beside| values[beside].lane().magnitude() <= here);
            let lowest = told.map(|beside| state.data()[beside].source()).min().unwrap_or(NO_SOURCE);
            if lowest < kept.source() {
                state.data_mut()[place] = SourceState::frozen(lowest);
                falls = true;
            }
        }
        changed |= falls;
        if !falls {
            return (changed, filled);
        }
    }
}
