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

/// Which rank takes which visits.
pub(crate) struct Share<'a> {
    comm: &'a dyn Comm,
    /// Voxels of a part along each axis, and which part lies in each such box.
    edge: [i64; 3],
    parts: HashMap<[i64; 3], usize>,
    /// The visits of this rank, and their chunks.
    own: Range<usize>,
    chunks: Vec<Box3>,
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
    /// Shares out visits, which all ranks list alike. Those of a part, a box of `edge` voxels that begins at a multiple of that,
    /// come one after the other and stay together: it holds whole shards.
    pub(crate) fn new(comm: &'a dyn Comm, visits: &[Vec<Box3>], edge: [i64; 3]) -> Self {
        let (mut parts, mut begins) = (HashMap::new(), Vec::new());
        for (n, visit) in visits.iter().enumerate() {
            let Some(chunk) = visit.first() else { continue };
            parts.entry(std::array::from_fn(|a| chunk.lo[a] / edge[a])).or_insert_with(|| {
                begins.push(n);
                begins.len() - 1
            });
        }
        let begin = |part: usize| begins.get(part).copied().unwrap_or(visits.len());
        let (rank, ranks) = (comm.rank(), comm.ranks());
        let own = begin(begins.len() * rank / ranks)..begin(begins.len() * (rank + 1) / ranks);
        let chunks = visits[own.clone()].iter().flatten().copied().collect();
        Self { comm, edge, parts, own, chunks }
    }

    /// The visits of this rank.
    pub(crate) fn own(&self) -> Range<usize> {
        self.own.clone()
    }

    /// This rank.
    pub(crate) fn rank(&self) -> usize {
        self.comm.rank()
    }

    /// The chunks of this rank's visits.
    pub(crate) fn chunks(&self) -> &[Box3] {
        &self.chunks
    }

    /// The rank that takes a voxel of the finest level.
    pub(crate) fn owner(&self, voxel: [i64; 3]) -> usize {
        let cell: [i64; 3] = std::array::from_fn(|a| voxel[a] / self.edge[a]);
        let part = self.parts.get(&cell).copied().unwrap_or(0);
        // Of all ranks the first whose parts end behind it.
        let ranks = self.comm.ranks();
        (0..ranks).find(|rank| part < self.parts.len() * (rank + 1) / ranks).unwrap_or(ranks - 1)
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
