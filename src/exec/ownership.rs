//! `Ownership`: which rank owns which brick.
//!
//! A rank owns a run of brick numbers. Numbers run along x, then y, then z, so a run is a slab of the domain with steps
//! at its ends; and whatever is summed in grid order is summed rank by rank. Cuts could be moved to where shards of an
//! output end, so that each shard has one rank that writes it: all that follows asks [`Ownership::owner`] only.

use std::ops::Range;

use super::comm::messages::Comm;
use super::halo::{HaloPlan, Reach};
use crate::error::Result;
use crate::grid::{BrickId, BrickSet, Slot};

/// The bricks of a grid, shared out between ranks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ownership {
    /// For each rank the brick number after its last one; the first rank's bricks start at 0.
    ends: Vec<BrickId>,
}

impl Ownership {
    /// Gives each of so many ranks as many bricks of the set as any other, or one more; none to some where there are
    /// fewer bricks than ranks.
    #[must_use]
    pub fn balanced(set: &BrickSet, ranks: usize) -> Self {
        let cut = |rank: usize| match set.len() * rank / ranks {
            all if all == set.len() => set.grid().len(),
            first => set.id(first as Slot),
        };
        Self { ends: (1..=ranks).map(cut).collect() }
    }

    /// Gives all bricks to the first of so many ranks.
    #[must_use]
    pub fn first(set: &BrickSet, ranks: usize) -> Self {
        Self { ends: vec![set.grid().len(); ranks] }
    }

    /// What the ranks' sets say: each tells the others where its bricks end.
    ///
    /// # Errors
    /// When another rank is gone.
    pub fn agreed(comm: &dyn Comm, set: &BrickSet) -> Result<Self> {
        let end = set.owned().last().map_or(0, |slot| set.id(slot) + 1);
        let mut ends = Vec::new();
        for bytes in comm.gather(end.to_le_bytes().to_vec())? {
            let end = bytes.try_into().map_or(0, BrickId::from_le_bytes);
            // A rank without bricks ends where the one before it does.
            ends.push(end.max(ends.last().copied().unwrap_or(0)));
        }
        Ok(Self { ends })
    }

    /// The rank that owns a brick.
    #[must_use]
    pub fn owner(&self, id: BrickId) -> usize {
        self.ends.partition_point(|&end| end <= id).min(self.ends.len() - 1)
    }

    /// The brick numbers of a rank.
    #[must_use]
    pub fn owned(&self, rank: usize) -> Range<BrickId> {
        rank.checked_sub(1).map_or(0, |before| self.ends[before])..self.ends[rank]
    }

    /// A rank's own set: the bricks of `set` that it owns and, as ghosts, those whose faces `plan` reads.
    #[must_use]
    pub fn part(&self, set: &BrickSet, rank: usize, plan: &HaloPlan) -> BrickSet {
        let offsets: Vec<[i64; 3]> = plan.reads().map(|(offset, _)| offset).collect();
        set.part(&self.owned(rank), &offsets)
    }
}

/// This rank's equal part of the bricks of a set, with all bricks around it as ghosts.
#[must_use]
pub fn equal_part(comm: &dyn Comm, set: &BrickSet) -> BrickSet {
    let plan = HaloPlan::new(*set.grid(), Reach::All);
    Ownership::balanced(set, comm.ranks()).part(set, comm.rank(), &plan)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exec::ThreadComm;
    use crate::grid::BrickGrid;

    #[test]
    fn every_brick_has_one_owner_and_no_rank_more_than_its_share() {
        let grid = BrickGrid::new([5, 3, 7], 1);
        for keep in [|_: BrickId| true, |id: BrickId| id % 3 == 1, |id: BrickId| id == 50] {
            let set = BrickSet::from_fn(grid, keep);
            for ranks in [1, 2, 3, 8, 64] {
                let ownership = Ownership::balanced(&set, ranks);
                for id in 0..grid.len() {
                    let owners = (0..ranks).filter(|&rank| ownership.owned(rank).contains(&id));
                    assert_eq!(owners.collect::<Vec<_>>(), [ownership.owner(id)], "{id} of {ranks} ranks");
                }
                let share = |rank| set.ids().filter(|&id| ownership.owner(id) == rank).count();
                let shares: Vec<usize> = (0..ranks).map(share).collect();
                assert!(shares.iter().max().unwrap() - shares.iter().min().unwrap() <= 1, "{shares:?}");
            }
        }
    }

    /// Ranks that know their own sets only find the owner of every stored brick.
    #[test]
    fn ranks_tell_each_other_what_they_own() {
        let grid = BrickGrid::new([3, 2, 2], 1);
        let plan = HaloPlan::new(grid, Reach::Faces);
        for keep in [|_: BrickId| true, |id: BrickId| id % 5 == 2] {
            let set = BrickSet::from_fn(grid, keep);
            for ranks in [1, 2, 3, 5] {
                let ownership = Ownership::balanced(&set, ranks);
                std::thread::scope(|scope| {
                    for comm in ThreadComm::connected(ranks) {
                        let (set, ownership, plan) = (&set, &ownership, &plan);
                        scope.spawn(move || {
                            let own = ownership.part(set, comm.rank(), plan);
                            let agreed = Ownership::agreed(&comm, &own).unwrap();
                            set.ids().for_each(|id| assert_eq!(agreed.owner(id), ownership.owner(id)));
                        });
                    }
                });
            }
        }
    }
}
