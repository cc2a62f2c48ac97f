//! `BrickSet`: the bricks of a grid that exist. A dense field holds all of them, a band only those near the surface.

use super::{BrickGrid, BrickId};

/// A brick's place in a set, and so in every array over that set: slots follow the order of brick numbers.
pub type Slot = u32;

const ABSENT: Slot = Slot::MAX;

/// A sorted set of bricks with a constant-time way from brick to slot.
#[derive(Clone, Debug)]
pub struct BrickSet {
    grid: BrickGrid,
    ids: Vec<BrickId>,
    slots: Vec<Slot>,
}

impl BrickSet {
    /// All bricks of the grid.
    #[must_use]
    pub fn dense(grid: BrickGrid) -> Self {
        Self::from_fn(grid, |_| true)
    }

    /// The bricks for which `keep` says yes.
    ///
    /// # Panics
    /// When the grid has 2^32 bricks or more: such a grid would not fit any disk.
    #[must_use]
    pub fn from_fn(grid: BrickGrid, mut keep: impl FnMut(BrickId) -> bool) -> Self {
        assert!(grid.len() < u64::from(ABSENT), "too many bricks for 32-bit slots");
        let mut ids = Vec::new();
        let mut slots = vec![ABSENT; grid.len() as usize];
        for id in 0..grid.len() {
            if keep(id) {
                slots[id as usize] = ids.len() as Slot;
                ids.push(id);
            }
        }
        Self { grid, ids, slots }
    }

    /// The grid the bricks belong to.
    #[must_use]
    pub fn grid(&self) -> &BrickGrid {
        &self.grid
    }

    /// Number of bricks in the set.
    #[must_use]
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    /// True when no brick is in the set.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// The bricks in order of their numbers; a brick's place is its slot.
    #[must_use]
    pub fn ids(&self) -> &[BrickId] {
        &self.ids
    }

    /// The brick in a slot.
    #[must_use]
    pub fn id(&self, slot: Slot) -> BrickId {
        self.ids[slot as usize]
    }

    /// The slot of a brick, or none when it is not in the set.
    #[must_use]
    pub fn slot(&self, id: BrickId) -> Option<Slot> {
        Some(self.slots[id as usize]).filter(|&s| s != ABSENT)
    }

    /// The slot of the brick beside `slot`, or none where it is absent or beyond the domain.
    #[must_use]
    pub fn neighbour(&self, slot: Slot, offset: [i64; 3]) -> Option<Slot> {
        self.grid.neighbour(self.id(slot), offset).and_then(|id| self.slot(id))
    }
}
