//! Voxels near a surface, block by block: on which side each is, and how much of that side is around it.
//!
//! A block is 16^3 voxels, `[z][y][x]`; a place is `4096 * block + voxel`. Blocks without the surface are not stored: they are *rooms*, each
//! of one side; rooms that touch are one.

use super::neighbourhood::offset;

/// Voxels along the edge of a block.
pub const EDGE: usize = 16;
/// Voxels of a block.
pub const LEN: usize = EDGE * EDGE * EDGE;
/// The bit of a voxel's state that says inside.
pub const INSIDE: u8 = 128;
/// The level of voxels that have their side alone around them.
pub const FAR: u8 = 127;

/// Levels of voxels that are as far from the other side, by how much of their own is around them; few, for they are gone through one by one.
pub const PARTS: u8 = 40;

/// What lies beside a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Beside {
    /// A stored block.
    Block(u32),
    /// A room.
    Room(u32),
}

/// Blocks that hold the surface, and the rooms around them.
pub struct Blocks {
    /// For each voxel [`INSIDE`] or 0, with how much of that side is around it: from 1 on, or [`FAR`].
    pub states: Vec<u8>,
    /// For each block the 27 around it, itself in the middle.
    pub around: Vec<[Beside; 27]>,
    /// Whether each room is inside.
    pub rooms: Vec<bool>,
    /// The first voxel of each block.
    pub origins: Vec<[i64; 3]>,
    /// Blocks whose voxels stay as they are.
    pub fixed: Vec<bool>,
}

/// Where a neighbour is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Where {
    /// A voxel's place.
    Voxel(usize),
    /// In a room.
    Room(u32),
}

const fn strides() -> [isize; 27] {
    let mut all = [0; 27];
    let mut bit = 0;
    while bit < 27 {
        let [x, y, z] = offset(bit);
        all[bit] = (x + 16 * y + 256 * z) as isize;
        bit += 1;
    }
    all
}

/// From a place to its neighbours, within a block.
pub const STRIDES: [isize; 27] = strides();

/// Whether all 26 neighbours of a place are in its block.
#[must_use]
#[inline]
pub fn is_deep(place: usize) -> bool {
    let within = |v: usize| v.wrapping_sub(1) < EDGE - 2;
    within(place % EDGE) && within(place / EDGE % EDGE) && within(place / (EDGE * EDGE) % EDGE)
}

impl Blocks {
    /// The neighbour of a place at one of the 27 bits.
    #[must_use]
    #[inline]
    pub fn neighbour(&self, place: usize, bit: usize) -> Where {
        if is_deep(place) {
            return Where::Voxel(place.wrapping_add_signed(STRIDES[bit]));
        }
        let by = offset(bit);
        let at = [place % EDGE, place / EDGE % EDGE, place / (EDGE * EDGE) % EDGE];
        let (mut block, mut voxel) = (0, 0);
        for axis in (0..3).rev() {
            let to = at[axis] as i64 + by[axis] + EDGE as i64;
            block = 3 * block + to as usize / EDGE;
            voxel = EDGE * voxel + to as usize % EDGE;
        }
        match self.around[place / LEN][block] {
            Beside::Block(block) => Where::Voxel(block as usize * LEN + voxel),
            Beside::Room(room) => Where::Room(room),
        }
    }

    /// The voxel of a place.
    #[must_use]
    pub fn voxel(&self, place: usize) -> [i64; 3] {
        let at = [place % EDGE, place / EDGE % EDGE, place / (EDGE * EDGE) % EDGE];
        let origin = self.origins[place / LEN];
        std::array::from_fn(|a| origin[a] + at[a] as i64)
    }

    /// Puts voxels on a side, at its border.
    pub fn put(&mut self, places: &[usize], inside: bool) {
        for &place in places {
            self.states[place] = 1 | if inside { INSIDE } else { 0 };
        }
    }

    /// Whether any of some voxels must stay as it is.
    #[must_use]
    pub fn holds_fixed(&self, places: &[usize]) -> bool {
        places.iter().any(|&place| self.fixed[place / LEN])
    }

    /// Whether a voxel is inside.
    #[must_use]
    #[inline]
    pub fn is_inside(&self, place: usize) -> bool {
        self.states[place] & INSIDE != 0
    }
}
