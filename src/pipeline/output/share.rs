//! How the visits of an image that is written are shared out between ranks, and what ranks tell each other of coarser levels.
//!
//! Each rank takes a run of the visits, so it writes whole shards of the finest level. A shard of a coarser level may lie over the
//! visits of several ranks: the one that takes its lowest voxel writes it, and gets from the others what they have put below it:
//!
//! ```text
//! lo, hi of the box in that level, 6 i64 | voxels of the level below u64 | 1 where values follow, else 0 | values
//! ```

use std::collections::HashMap;
use std::ops::Range;

use crate::error::{Error, Result};
use crate::exec::Comm;
use crate::grid::Box3;
use crate::store::Element;

/// Which rank takes which visit.
pub(crate) struct Share<'a> {
    comm: &'a dyn Comm,
    visits: usize,
    /// Voxels of a visit along each axis, and the visit of each such box.
    edge: [i64; 3],
    numbers: HashMap<[i64; 3], usize>,
    boxes: Vec<Vec<Box3>>,
}

/// A box of a coarser level that a rank has put together.
pub(crate) struct Piece<T> {
    pub(crate) part: Box3,
    /// Voxels of the level below that went into it.
    pub(crate) below: u64,
    /// Dense `[z][y][x]`; empty where all are zero.
    pub(crate) values: Vec<T>,
}

impl<'a> Share<'a> {
    /// Shares out visits, which all ranks list alike and of which each makes up a box.
    pub(crate) fn new(comm: &'a dyn Comm, visits: &[Vec<Box3>]) -> Self {
        let lo_of =
            |visit: &[Box3]| visit.iter().map(|part| part.lo).reduce(|a, b| std::array::from_fn(|n| a[n].min(b[n])));
        let hi_of =
            |visit: &[Box3]| visit.iter().map(|part| part.hi).reduce(|a, b| std::array::from_fn(|n| a[n].max(b[n])));
        // The first one begins at the lowest voxel and is no smaller than any other.
        let edge = visits.first().and_then(|visit| hi_of(visit)).unwrap_or([1; 3]).map(|n| n.max(1));
        let cell = |lo: [i64; 3]| std::array::from_fn(|a| lo[a] / edge[a]);
        let numbers = visits.iter().enumerate().filter_map(|(n, visit)| Some((cell(lo_of(visit)?), n))).collect();
        let mut share = Self { comm, visits: visits.len(), edge, numbers, boxes: Vec::new() };
        share.boxes = visits[share.own()].to_vec();
        share
    }

    /// The visits of this rank.
    pub(crate) fn own(&self) -> Range<usize> {
        let (rank, ranks) = (self.comm.rank(), self.comm.ranks());
        self.visits * rank / ranks..self.visits * (rank + 1) / ranks
    }

    /// This rank.
    pub(crate) fn rank(&self) -> usize {
        self.comm.rank()
    }

    /// The chunks of this rank's visits.
    pub(crate) fn chunks(&self) -> impl Iterator<Item = &Box3> {
        self.boxes.iter().flatten()
    }

    /// The rank that takes a voxel of the finest level.
    pub(crate) fn owner(&self, voxel: [i64; 3]) -> usize {
        let cell: [i64; 3] = std::array::from_fn(|a| voxel[a] / self.edge[a]);
        let visit = self.numbers.get(&cell).copied().unwrap_or(0);
        // Of all ranks the first whose visits end behind it.
        let ranks = self.comm.ranks();
        (0..ranks).find(|rank| visit < self.visits * (rank + 1) / ranks).unwrap_or(ranks - 1)
    }

    /// Sends pieces to the ranks they are for, and returns what has come for this one.
    ///
    /// # Errors
    /// When another rank is gone.
    pub(crate) fn exchange<T: Element>(&self, pieces: &[(usize, Piece<T>)]) -> Result<Vec<Piece<T>>> {
        let others: Vec<usize> = (0..self.comm.ranks()).filter(|&rank| rank != self.comm.rank()).collect();
        let message = |rank: usize| {
            let mut message = Vec::new();
            pieces.iter().filter(|(to, _)| *to == rank).for_each(|(_, piece)| piece.append_to(&mut message));
            message
        };
        let mut come = Vec::new();
        for message in self.comm.exchange(&others, others.iter().map(|&rank| message(rank)).collect())? {
            let mut rest = message.as_slice();
            while !rest.is_empty() {
                let (piece, behind) = Piece::first_of(rest).ok_or_else(|| {
                    Error::failed(
                        "a message between ranks is damaged; all ranks must run the same version of the program",
                    )
                })?;
                come.push(piece);
                rest = behind;
            }
        }
        Ok(come)
    }
}

impl<T: Element> Piece<T> {
    fn append_to(&self, message: &mut Vec<u8>) {
        let numbers = self.part.lo.iter().chain(&self.part.hi).map(|n| n.to_le_bytes());
        numbers.chain([self.below.to_le_bytes()]).for_each(|word| message.extend_from_slice(&word));
        message.push(u8::from(!self.values.is_empty()));
        T::append_bytes(&self.values, message);
    }

    fn first_of(message: &[u8]) -> Option<(Self, &[u8])> {
        let (head, rest) = message.split_at_checked(7 * 8)?;
        let words = head.as_chunks().0;
        let at = |n: usize| std::array::from_fn(|a| i64::from_le_bytes(words[n + a]));
        let part = Box3::new(at(0), at(3));
        let (has_values, rest) = rest.split_first()?;
        let count = if *has_values == 1 { part.len() } else { 0 };
        let (bytes, rest) = rest.split_at_checked(count.checked_mul(size_of::<T>())?)?;
        let mut values = vec![T::default(); count];
        T::fill_from_bytes(&mut values, bytes);
        Some((Self { part, below: u64::from_le_bytes(words[6]), values }, rest))
    }
}
