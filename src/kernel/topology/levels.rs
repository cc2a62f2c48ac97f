//! The voxels of one side by their levels: sorted once, block by block, so that a side is grown without a look at all voxels for each level.

use super::blocks::{Blocks, FAR, INSIDE, LEN};

/// Levels that are told apart, [`FAR`] left out.
const LEVELS: usize = FAR as usize;

/// The voxels of one side near the other, by level.
pub struct Levels {
    /// Voxels of all blocks, block by block those of each level in order.
    voxels: Vec<u16>,
    /// For each block where its voxels of each level begin, and where its last end.
    begins: Vec<[u32; LEVELS + 1]>,
    /// For each block where its voxels begin.
    blocks: Vec<usize>,
}

impl Levels {
    /// Sorts the voxels of a side by what `level_of` makes of their states; those that are [`FAR`] are left out.
    #[must_use]
    pub fn new(blocks: &Blocks, inside: bool, level_of: impl Fn(u8) -> u8) -> Self {
        let side = if inside { INSIDE } else { 0 };
        let near = |state: u8| state & INSIDE == side && state & FAR != FAR;
        let mut sorted = Self { voxels: Vec::new(), begins: Vec::new(), blocks: Vec::new() };
        for states in blocks.states.chunks_exact(LEN) {
            let mut begins = [0_u32; LEVELS + 1];
            for &state in states.iter().filter(|&&state| near(state)) {
                begins[usize::from(level_of(state)) + 1] += 1;
            }
            for level in 0..LEVELS {
                begins[level + 1] += begins[level];
            }
            let from = sorted.voxels.len();
            sorted.voxels.resize(from + begins[LEVELS] as usize, 0);
            let mut next = begins;
            for (voxel, &state) in states.iter().enumerate().filter(|(_, state)| near(**state)) {
                let to = &mut next[usize::from(level_of(state))];
                sorted.voxels[from + *to as usize] = voxel as u16;
                *to += 1;
            }
            sorted.begins.push(begins);
            sorted.blocks.push(from);
        }
        sorted
    }

    /// The places of a level, in order.
    pub fn places(&self, level: u8) -> impl Iterator<Item = usize> + '_ {
        let level = usize::from(level);
        self.begins.iter().zip(&self.blocks).enumerate().flat_map(move |(block, (begins, from))| {
            let of_level = from + begins[level] as usize..from + begins[level + 1] as usize;
            self.voxels[of_level].iter().map(move |&voxel| block * LEN + usize::from(voxel))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_level_has_its_places_in_order() {
        let states: Vec<u8> = (0..3 * LEN).map(|n| ((n * n + 7 * n / 5) % 251) as u8).collect();
        let blocks = Blocks { states, around: Vec::new(), rooms: Vec::new(), origins: Vec::new(), fixed: Vec::new() };
        for inside in [false, true] {
            let levels = Levels::new(&blocks, inside, |state| (state & FAR) / 2);
            for level in 0..FAR {
                let is_of = |state: u8| (state >= 128) == inside && state & FAR != FAR && (state & FAR) / 2 == level;
                let plain = (0..3 * LEN).filter(|&place| is_of(blocks.states[place]));
                assert!(levels.places(level).eq(plain), "{inside} {level}");
            }
        }
    }
}
