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

use crate::error::Result;
use crate::exec::{Comm, Message, ROUND_BYTES, gather_records};
use crate::grid::Box3;
use crate::io::ome_zarr::LevelWriter;
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
        let begins = parts(visits, edge);
        let cell = |&begin: &usize| visits[begin].first().map(|chunk| std::array::from_fn(|a| chunk.lo[a] / edge[a]));
        let parts = begins.iter().enumerate().filter_map(|(part, begin)| Some((cell(begin)?, part))).collect();
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

    /// Sends pieces to the ranks they are for, some at a time, and hands on what comes for this one. `pieces` are told by what they
    /// are and to whom, and made when it is their turn.
    ///
    /// # Errors
    /// When a piece cannot be made or taken, or another rank is gone.
    pub(crate) fn exchange<T: Element, W>(
        &self,
        pieces: &[(usize, W)],
        make: impl Fn(&W) -> Result<Piece<T>>,
        mut take: impl FnMut(Piece<T>) -> Result<()>,
    ) -> Result<()> {
        let others = self.comm.others();
        let mut left = pieces.iter();
        while self.comm.any(left.len() > 0)? {
            let mut messages = vec![Vec::new(); self.comm.ranks()];
            let mut bytes = 0;
            while bytes < ROUND_BYTES
                && let Some((to, what)) = left.next()
            {
                let before = messages[*to].len();
                make(what)?.append_to(&mut messages[*to]);
                bytes += messages[*to].len() - before;
            }
            let messages = others.iter().map(|&rank| std::mem::take(&mut messages[rank])).collect();
            for message in self.comm.exchange(&others, messages)? {
                let mut rest = Message(&message);
                while !rest.is_empty() {
                    take(Piece::first_of(&mut rest)?)?;
                }
            }
        }
        Ok(())
    }
}

/// The visits with which parts begin: boxes of `edge` voxels, whose visits come one after the other.
pub(crate) fn parts(visits: &[Vec<Box3>], edge: [i64; 3]) -> Vec<usize> {
    let part = |visit: &Vec<Box3>| visit.first().map(|chunk| [0, 1, 2].map(|a| chunk.lo[a] / edge[a]));
    let is_new = |&n: &usize| n == 0 || part(&visits[n]) != part(&visits[n - 1]);
    (0..visits.len()).filter(is_new).collect()
}

/// The threads of all ranks: whatever each has, all cut the volume alike.
///
/// # Errors
/// When another rank is gone.
pub(crate) fn all_threads(comm: &dyn Comm, own: usize) -> Result<usize> {
    Ok(gather_records(comm, &own)?.into_iter().sum())
}

/// The largest shard of some levels.
pub(crate) fn largest_shard<'a>(levels: impl IntoIterator<Item = &'a LevelWriter>) -> Option<[i64; 3]> {
    levels.into_iter().map(LevelWriter::shard_shape).max_by_key(|edge| edge.iter().product::<i64>())
}

impl<T: Element> Piece<T> {
    fn append_to(&self, message: &mut Vec<u8>) {
        let numbers = self.part.lo.iter().chain(&self.part.hi).map(|n| n.to_le_bytes());
        numbers.chain([self.below.to_le_bytes()]).for_each(|word| message.extend_from_slice(&word));
        message.push(u8::from(!self.values.is_empty()));
        T::append_bytes(&self.values, message);
    }

    fn first_of(message: &mut Message<'_>) -> Result<Self> {
        let mut corner = || -> Result<[i64; 3]> {
            let words: [u8; 24] = message.word()?;
            let words = words.as_chunks().0;
            Ok(std::array::from_fn(|a| i64::from_le_bytes(words[a])))
        };
        let part = Box3::new(corner()?, corner()?);
        let below = u64::from_le_bytes(message.word()?);
        let count = if message.word()? == [1] { part.len() } else { 0 };
        let mut values = vec![T::default(); count];
        T::fill_from_bytes(&mut values, message.take(count * size_of::<T>())?);
        Ok(Self { part, below, values })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exec::ThreadComm;

    /// Boxes of a row of cubes, numbered along it.
    fn cube(number: i64) -> Box3 {
        Box3::new([64 * number, 0, 0], [64 * (number + 1), 64, 64])
    }

    /// More than travels at a time, pieces without a value among it: each arrives once, where it was sent, as it was.
    #[test]
    fn pieces_arrive_in_as_many_rounds_as_it_takes() {
        let visits: Vec<Vec<Box3>> = (0..30).map(|number| vec![cube(number)]).collect();
        let values = |number: i64| if number % 7 == 0 { Vec::new() } else { vec![number as f64; 1 << 18] };
        std::thread::scope(|scope| {
            for comm in ThreadComm::connected(3) {
                let (visits, values) = (&visits, &values);
                scope.spawn(move || {
                    let share = Share::new(&comm, visits, [64; 3]);
                    let to = |number: i64| ((number + 1) % 3) as usize;
                    let own = share.own().map(|visit| visit as i64).filter(|&number| to(number) != share.rank());
                    let pieces: Vec<(usize, i64)> = own.map(|number| (to(number), number)).collect();
                    let make = |&number: &i64| {
                        Ok(Piece { part: cube(number), below: number as u64 + 5, values: values(number) })
                    };
                    let mut come = Vec::new();
                    let take = |piece: Piece<f64>| {
                        let number = piece.part.lo[0] / 64;
                        assert_eq!((piece.part, piece.below), (cube(number), number as u64 + 5));
                        assert!(piece.values == values(number), "{number}");
                        come.push(number);
                        Ok(())
                    };
                    share.exchange(&pieces, make, take).unwrap();
                    let is_for_me =
                        |number: &i64| to(*number) == share.rank() && share.owner(cube(*number).lo) != share.rank();
                    come.sort_unstable();
                    assert_eq!(come, (0..30).filter(is_for_me).collect::<Vec<_>>());
                    let sent: usize = pieces.iter().map(|(_, number)| 8 * values(*number).len()).sum();
                    assert!(sent > ROUND_BYTES, "{sent}");
                });
            }
        });
    }
}
