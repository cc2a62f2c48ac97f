//! Sources of the voxels that fell in a sweep of FSM (Kósa & Mikula 2023, Alg. 7; docs/algorithms.md, "Source
//! tracking"), brick by brick.
//!
//! In the triple loop a voxel copies the source of one of 26 neighbours, as it is at that moment: its new one where the
//! neighbour comes before it in the order of the loop, else the one it had before the sweep. Tiles are swept in another
//! order, in which a neighbour that comes before may lie in a tile whose turn is still to come: (+1, -1, 0) in a sweep
//! upward. Such a voxel is left *pending*, and so is one that copies from it; they are resolved when all tiles were
//! swept. In: the voxels that fell, in an order that puts those first that come first for their neighbours in the same
//! tile; the sources of a brick, `[z][y][x]`; ghosts as they are now and as they were before the sweep. Out: the
//! brick's sources.

use super::upwind::Upwind;
use crate::grid::MOST_SOURCES;
use crate::grid::{NO_SOURCE, SourceState};
use crate::kernel::distance::tile_order::diagonals::MOST_LANES;
use crate::tile::HaloTile;

/// Voxels that fell in a sweep, of a run along a diagonal of their tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fell {
    /// Where the first of the run lies in the tile, from 0. From one to the next x falls by 1, and y rises or, in
    /// sweeps of opposite directions along x and y, falls by 1.
    pub(crate) first: [i16; 3],
    /// Bit n that the n-th of the run fell.
    pub(crate) which: u16,
    /// From which neighbours.
    pub(crate) from: [Upwind; MOST_LANES],
}

impl Fell {
    /// The voxels that fell, in the order of the sweep.
    #[inline(always)]
    fn each(&self, upward: [bool; 3], mut f: impl FnMut([usize; 3], Upwind)) {
        let [x, y, z] = self.first.map(isize::from);
        let along_y = if upward[0] == upward[1] { 1 } else { -1 };
        let mut which = self.which;
        while which != 0 {
            let n = if upward[0] { which.trailing_zeros() } else { which.ilog2() };
            which &= !(1 << n);
            let voxel = [x - n as isize, y + along_y * n as isize, z];
            f(voxel.map(|n| n as usize), self.from[n as usize]);
        }
    }
}

/// The state of a voxel whose source is not known yet: its index is below [`NO_SOURCE`] and above all sources.
fn pending(from: Upwind) -> SourceState {
    SourceState::trial(NO_SOURCE - 1 - u32::from(from.0))
}

fn pending_from(state: SourceState) -> Option<Upwind> {
    let from = NO_SOURCE.wrapping_sub(1).wrapping_sub(state.bits());
    u8::try_from(from).ok().map(Upwind)
}

fn any_pending(states: &[SourceState]) -> bool {
    states.iter().fold(false, |any, &state| any | pending_from(state).is_some())
}

/// The neighbours that a voxel may copy from.
#[derive(Clone, Copy, Debug, Default)]
struct Way {
    sum: Neighbour,
    first: Neighbour,
}

#[derive(Clone, Copy, Debug, Default)]
struct Neighbour {
    offset: [i8; 3],
    /// Whether it comes before the voxel in the triple loop.
    before: bool,
}

/// Sources in a sweep of one direction.
#[derive(Clone, Debug)]
pub struct SweepSources {
    upward: [bool; 3],
    ways: Vec<Way>,
}

/// The ghosts of a brick; nothing else of these tiles is read.
#[derive(Debug)]
pub struct Ghosts {
    /// Their sources before the sweep.
    pub before: HaloTile<SourceState>,
    /// Their sources now, in tiles that were swept already.
    pub now: HaloTile<SourceState>,
}

impl Ghosts {
    /// Of bricks of `edge`^3 voxels.
    #[must_use]
    pub fn new(edge: usize) -> Self {
        Self { before: HaloTile::new(edge), now: HaloTile::new(edge) }
    }
}

/// A brick and its ghosts; which tiles were swept.
struct Around<'a> {
    brick: &'a mut [SourceState],
    edge: usize,
    valid: [usize; 3],
    ghosts: &'a Ghosts,
    /// Whether all tiles were, or only those upwind.
    all: bool,
}

impl SweepSources {
    /// For a sweep of that direction.
    #[must_use]
    pub fn new(upward: [bool; 3]) -> Self {
        let neighbour = |offset: [i8; 3]| {
            let slowest = (0..3).rev().find(|&a| offset[a] != 0).unwrap_or(0);
            Neighbour { offset, before: (offset[slowest] < 0) == upward[slowest] }
        };
        let way = |code: u8| Way { sum: neighbour(Upwind(code).sum()), first: neighbour(Upwind(code).first()) };
        Self { upward, ways: (0..=u8::MAX).map(way).collect() }
    }

    /// Whether tiles at that offset are swept before the one in the middle.
    #[must_use]
    pub fn is_upwind(&self, offset: [i64; 3]) -> bool {
        (0..3).map(|a| if self.upward[a] { offset[a] } else { -offset[a] }).sum::<i64>() < 0
    }

    /// Gives the voxels that fell in a brick with room for `edge`^3, `valid` of them in the domain, their sources.
    /// Ghosts now are known in tiles upwind. Returns whether any voxel is left pending.
    pub fn take(
        &self,
        fell: &[Fell],
        brick: &mut [SourceState],
        edge: usize,
        valid: [usize; 3],
        ghosts: &Ghosts,
    ) -> bool {
        let around = Around { brick, edge, valid, ghosts, all: false };
        let step = |way: &Way| {
            let [x, y, z] = way.sum.offset.map(isize::from);
            (z * edge as isize + y) * edge as isize + x
        };
        let steps: Vec<isize> = self.ways.iter().map(step).collect();
        let mut left = false;
        for fell in fell {
            fell.each(self.upward, |voxel, from| {
                let place = around.place(voxel);
                let inside = (0..3).all(|a| voxel[a] > 0 && voxel[a] + 1 < valid[a]);
                // By far the most are taken without asking where the neighbour lies.
                let beside = place.wrapping_add_signed(steps[usize::from(from.0)]);
                let sum = if inside { around.brick[beside].thaw() } else { SourceState::FAR };
                let is_known = (sum.source() as usize) < MOST_SOURCES;
                let state = if is_known { sum } else { self.source(&around, voxel, from) };
                left |= pending_from(state).is_some();
                around.brick[place] = state;
            });
        }
        left
    }

    /// Resolves pending voxels of a brick when all tiles were swept. Returns whether any was, and whether any is left.
    pub fn resolve(&self, brick: &mut [SourceState], edge: usize, valid: [usize; 3], ghosts: &Ghosts) -> (bool, bool) {
        let around = Around { brick, edge, valid, ghosts, all: true };
        let ordered = |axis: usize| {
            let (count, upward) = (valid[axis], self.upward[axis]);
            (0..count).map(move |i| if upward { i } else { count - 1 - i })
        };
        let (mut found, mut left) = (false, false);
        for z in ordered(2) {
            for y in ordered(1) {
                let row = around.place([0, y, z]);
                if !any_pending(&around.brick[row..][..valid[0]]) {
                    continue;
                }
                for x in ordered(0) {
                    let Some(from) = pending_from(around.brick[row + x]) else { continue };
                    let state = self.source(&around, [x, y, z], from);
                    around.brick[row + x] = state;
                    let resolved = pending_from(state).is_none();
                    found |= resolved;
                    left |= !resolved;
                }
            }
        }
        (found, left)
    }

    /// The state of a voxel that fell from those neighbours.
    #[inline]
    fn source(&self, around: &Around<'_>, voxel: [usize; 3], from: Upwind) -> SourceState {
        let way = &self.ways[usize::from(from.0)];
        let sum = self.state(around, voxel, way.sum);
        if pending_from(sum).is_some() {
            return pending(from);
        }
        if sum.has_source() {
            return sum.thaw();
        }
        let first = self.state(around, voxel, way.first);
        if pending_from(first).is_some() { pending(from.first_alone()) } else { first.thaw() }
    }

    /// The state of a neighbour at the voxel's turn in the triple loop; pending where it is not known yet.
    #[inline]
    fn state(&self, around: &Around<'_>, voxel: [usize; 3], neighbour: Neighbour) -> SourceState {
        let at: [isize; 3] = std::array::from_fn(|a| voxel[a] as isize + isize::from(neighbour.offset[a]));
        let [x, y, z] = at.map(|n| n as usize);
        if x < around.valid[0] && y < around.valid[1] && z < around.valid[2] {
            return around.brick[around.place([x, y, z])];
        }
        let Ghosts { before, now } = around.ghosts;
        if !neighbour.before {
            return before.data()[before.at(at[0], at[1], at[2])];
        }
        let beyond = std::array::from_fn(|a| i64::from(at[a] >= around.valid[a] as isize) - i64::from(at[a] < 0));
        if around.all || self.is_upwind(beyond) { now.data()[now.at(at[0], at[1], at[2])] } else { pending(Upwind(0)) }
    }
}

impl Around<'_> {
    #[inline]
    fn place(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.edge + y) * self.edge + x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pending_states_are_no_sources() {
        for code in 0..=u8::MAX {
            assert_eq!(pending_from(pending(Upwind(code))), Some(Upwind(code)));
            assert!(pending(Upwind(code)).source() as usize >= MOST_SOURCES);
        }
        assert_eq!(pending_from(SourceState::FAR), None);
        assert_eq!(pending_from(SourceState::trial(MOST_SOURCES as u32 - 1)), None);
        assert_eq!(pending_from(SourceState::frozen(7)), None);
    }
}
