//! Schedules: orders in which bricks may be computed so that no result depends on threads.
//!
//! A schedule is a list of waves. Bricks of one wave run in parallel and must not read what another of them writes;
//! waves follow each other. Nothing here looks at data. Ghost bricks of other ranks are in no wave.

use crate::grid::{BrickSet, Slot};

/// All bricks at once: for kernels that write only what no neighbour reads in the same pass.
#[must_use]
pub fn one_wave(set: &BrickSet) -> Vec<Slot> {
    set.owned().collect()
}

/// Two waves, the bricks of even and of odd parity: no two bricks of a wave share a face.
#[must_use]
pub fn checkerboard(set: &BrickSet) -> Vec<Vec<Slot>> {
    coloured(set, 2, |at| at.iter().sum::<i64>() & 1)
}

/// Eight waves by the parities of bricks along each axis: no two bricks of a wave share a face, an edge or a corner.
#[must_use]
pub fn corner_colours(set: &BrickSet) -> Vec<Vec<Slot>> {
    coloured(set, 8, |at| at.iter().rev().fold(0, |colour, at| colour << 1 | (at & 1)))
}

fn coloured(set: &BrickSet, colours: usize, colour: impl Fn([i64; 3]) -> i64) -> Vec<Vec<Slot>> {
    let mut waves = vec![Vec::new(); colours];
    for slot in set.owned() {
        waves[colour(set.grid().coords(set.id(slot))) as usize].push(slot);
    }
    waves
}

/// The diagonal planes of bricks in sweep order: `upward[a]` says whether axis `a` is swept from low to high.
///
/// Every brick comes after the three it depends on upwind, and the bricks of a plane do not share faces, so a sweep
/// over the waves gives bit for bit what the triple loop over voxels gives (docs/algorithms.md, "The sweep schedule").
/// Planes are those of the grid, whether a rank has bricks in them or not, so that all ranks go through them in step.
#[must_use]
pub fn sweep_waves(set: &BrickSet, upward: [bool; 3]) -> Vec<Vec<Slot>> {
    let counts = set.grid().counts();
    let planes = counts.iter().sum::<i64>() - 2;
    let mut waves = vec![Vec::new(); planes as usize];
    for slot in set.owned() {
        let at = set.grid().coords(set.id(slot));
        let plane: i64 = (0..3).map(|a| if upward[a] { at[a] } else { counts[a] - 1 - at[a] }).sum();
        waves[plane as usize].push(slot);
    }
    waves
}
