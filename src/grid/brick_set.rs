//! `BrickSet`: the bricks of a grid that exist. A dense field holds all of them, a band only those near the surface.
//!
//! One rank of many has a set of its own: the bricks that it owns, and around them *ghost* bricks that others own and
//! of which it knows the faces only. Slots are the rank's own count; those of owned bricks follow each other.

use std::ops::Range;

use super::{BrickGrid, BrickId};

/// A brick's place in a set, and so in every array over that set: slots follow the order of brick numbers.
pub type Slot = u32;

const ABSENT: Slot = Slot::MAX;

/// A sorted set of bricks with a constant-time way from brick to slot.
#[derive(Clone, Debug)]
pub struct BrickSet {
    grid: BrickGrid,
    bricks: Bricks,
    owned: Range<Slot>,
}

/// Which bricks. A rank of many has a few of a large grid: what it keeps of them is as large as what lies between its first
/// and its last one, not as the grid.
#[derive(Clone, Debug)]
enum Bricks {
    /// All of the grid: a brick's slot is its number.
    All,
    /// Those of these numbers; the slot of each number from the first one to the last.
    Some { ids: Vec<BrickId>, slots: Vec<Slot> },
}

impl BrickSet {
    /// All bricks of the grid.
    ///
    /// # Panics
    /// When the grid has 2^32 bricks or more: such a grid would not fit any disk.
    #[must_use]
    pub fn dense(grid: BrickGrid) -> Self {
        assert!(grid.len() < u64::from(ABSENT), "too many bricks for 32-bit slots");
        Self { grid, bricks: Bricks::All, owned: 0..grid.len() as Slot }
    }

    /// The bricks for which `keep` says yes.
    ///
    /// # Panics
    /// When the grid has 2^32 bricks or more: such a grid would not fit any disk.
    #[must_use]
    pub fn from_fn(grid: BrickGrid, mut keep: impl FnMut(BrickId) -> bool) -> Self {
        Self::from_ids(grid, (0..grid.len()).filter(|&id| keep(id)).collect())
    }

    /// The bricks of these numbers, which are in order, each once.
    ///
    /// # Panics
    /// When the grid has 2^32 bricks or more: such a grid would not fit any disk.
    #[must_use]
    pub fn from_ids(grid: BrickGrid, ids: Vec<BrickId>) -> Self {
        assert!(grid.len() < u64::from(ABSENT), "too many bricks for 32-bit slots");
        debug_assert!(ids.is_sorted_by(|a, b| a < b), "numbers come in order");
        let reach = ids.first().zip(ids.last()).map_or(0, |(first, last)| last - first + 1);
        let mut slots = vec![ABSENT; reach as usize];
        for (slot, id) in (0..).zip(&ids) {
            slots[(id - ids[0]) as usize] = slot;
        }
        let owned = 0..ids.len() as Slot;
        Self { grid, bricks: Bricks::Some { ids, slots }, owned }
    }

    /// The part of a rank that owns the bricks numbered `owned`: those of them that are in this set, and as ghosts the
    /// set's bricks that lie beside them at one of `offsets`.
    #[must_use]
    pub fn part(&self, owned: &Range<BrickId>, offsets: &[[i64; 3]]) -> Self {
        let own = self.before(owned.start)..self.before(owned.end);
        let mut ids: Vec<BrickId> = own.clone().map(|slot| self.id(slot)).collect();
        for slot in own {
            let beside = offsets.iter().filter_map(|&offset| self.neighbour(slot, offset)).map(|ghost| self.id(ghost));
            ids.extend(beside.filter(|id| !owned.contains(id)));
        }
        ids.sort_unstable();
        ids.dedup();
        let mut part = Self::from_ids(self.grid, ids);
        part.owned = part.before(owned.start)..part.before(owned.end);
        part
    }

    /// How many bricks of the set have a number below one.
    fn before(&self, id: BrickId) -> Slot {
        match &self.bricks {
            Bricks::All => id.min(self.grid.len()) as Slot,
            Bricks::Some { ids, .. } => ids.partition_point(|&other| other < id) as Slot,
        }
    }

    /// The slots of owned bricks; all of them where there is one rank.
    #[must_use]
    pub fn owned(&self) -> Range<Slot> {
        self.owned.clone()
    }

    /// The slots of ghost bricks.
    pub fn ghosts(&self) -> impl Iterator<Item = Slot> + use<> {
        (0..self.owned.start).chain(self.owned.end..self.len() as Slot)
    }

    /// The grid the bricks belong to.
    #[must_use]
    pub fn grid(&self) -> &BrickGrid {
        &self.grid
    }

    /// Number of bricks in the set, ghosts too.
    #[must_use]
    pub fn len(&self) -> usize {
        match &self.bricks {
            Bricks::All => self.grid.len() as usize,
            Bricks::Some { ids, .. } => ids.len(),
        }
    }

    /// True when no brick is in the set.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The bricks in order of their numbers; a brick's place is its slot.
    #[must_use]
    pub fn ids(&self) -> impl ExactSizeIterator<Item = BrickId> {
        (0..self.len()).map(|slot| self.id(slot as Slot))
    }

    /// The brick in a slot.
    #[must_use]
    pub fn id(&self, slot: Slot) -> BrickId {
        match &self.bricks {
            Bricks::All => BrickId::from(slot),
            Bricks::Some { ids, .. } => ids[slot as usize],
        }
    }

    /// The slot of a brick, or none when it is not in the set.
    #[must_use]
    pub fn slot(&self, id: BrickId) -> Option<Slot> {
        match &self.bricks {
            Bricks::All => Some(id as Slot),
            Bricks::Some { ids, slots } => {
                let place = id.checked_sub(*ids.first()?)?;
                slots.get(place as usize).copied().filter(|&slot| slot != ABSENT)
            }
        }
    }

    /// The slot of a brick of any grid as large, or none where it is not in the set or is a ghost.
    #[must_use]
    pub fn own_slot(&self, id: BrickId) -> Option<Slot> {
        let known = Some(id).filter(|&id| id < self.grid.len()).and_then(|id| self.slot(id));
        known.filter(|slot| self.owned.contains(slot))
    }

    /// The slot of the brick beside `slot`, or none where it is absent or beyond the domain.
    #[must_use]
    pub fn neighbour(&self, slot: Slot, offset: [i64; 3]) -> Option<Slot> {
        self.grid.neighbour(self.id(slot), offset).and_then(|id| self.slot(id))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{FACES, Face, NEIGHBOURS_26};

    #[test]
    fn a_part_holds_its_bricks_and_those_beside_them() {
        let whole = BrickSet::from_fn(BrickGrid::new([5, 4, 3], 1), |id| id % 7 != 3);
        let faces = FACES.map(Face::offset);
        for offsets in [&faces[..], &NEIGHBOURS_26[..]] {
            for owned in [0..60, 0..0, 11..26, 33..34, 40..60] {
                let part = whole.part(&owned, offsets);
                let here = |id: BrickId| whole.slot(id).is_some();
                let is_owned = |id: &BrickId| here(*id) && owned.contains(id);
                let is_ghost = |id: &BrickId| {
                    let touches = |offset: &[i64; 3]| whole.grid.neighbour(*id, *offset).is_some_and(|n| is_owned(&n));
                    here(*id) && !owned.contains(id) && offsets.iter().any(touches)
                };
                let ids = |slots: &mut dyn Iterator<Item = Slot>| slots.map(|slot| part.id(slot)).collect::<Vec<_>>();
                assert_eq!(ids(&mut part.owned()), (0..60).filter(is_owned).collect::<Vec<_>>());
                assert_eq!(ids(&mut part.ghosts()), (0..60).filter(is_ghost).collect::<Vec<_>>());
            }
        }
    }
}
