//! `ThreadComm`: ranks that are threads of one process. Between each two of them runs a channel in either direction;
//! messages are bytes and no memory is shared, so a run on threads exchanges what a run on many machines would.

use crossbeam_channel::{Receiver, Sender, unbounded};

use super::messages::Comm;
use crate::error::{Error, Result};

/// One rank's ends of the channels.
pub struct ThreadComm {
    rank: usize,
    to: Vec<Sender<Vec<u8>>>,
    from: Vec<Receiver<Vec<u8>>>,
}

impl ThreadComm {
    /// So many ranks, each connected with all of them, in order of their numbers.
    #[must_use]
    pub fn connected(ranks: usize) -> Vec<Self> {
        let mut all: Vec<Self> = (0..ranks).map(|rank| Self { rank, to: Vec::new(), from: Vec::new() }).collect();
        for sender in 0..ranks {
            for receiver in 0..ranks {
                let (to, from) = unbounded();
                all[sender].to.push(to);
                all[receiver].from.push(from);
            }
        }
        all
    }
}

impl Comm for ThreadComm {
    fn rank(&self) -> usize {
        self.rank
    }

    fn ranks(&self) -> usize {
        self.to.len()
    }

    /// Channels hold any number of messages, so no two ranks can wait for each other. A rank that ends, for whatever
    /// reason, closes its channels, and whoever waits for it ends too.
    fn post(&self, with: &[usize], messages: Vec<Vec<u8>>) -> Result<()> {
        with.iter().zip(messages).try_for_each(|(&rank, message)| self.to[rank].send(message).map_err(|_| gone(rank)))
    }

    fn collect(&self, with: &[usize]) -> Result<Vec<Vec<u8>>> {
        with.iter().map(|&rank| self.from[rank].recv().map_err(|_| gone(rank))).collect()
    }
}

fn gone(rank: usize) -> Error {
    Error::failed(format!("rank {rank} ended before the work was done"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs `work` on each of so many ranks; results in order of ranks.
    fn on_ranks<R: Send>(ranks: usize, work: impl Fn(&ThreadComm) -> R + Sync) -> Vec<R> {
        let work = &work;
        std::thread::scope(|scope| {
            let started: Vec<_> =
                ThreadComm::connected(ranks).into_iter().map(|comm| scope.spawn(move || work(&comm))).collect();
            started.into_iter().map(|rank| rank.join().unwrap()).collect()
        })
    }

    #[test]
    fn messages_arrive_from_whom_and_in_the_order_in_which_they_were_sent() {
        let ranks = 4;
        on_ranks(ranks, |comm| {
            // A ring: each talks with those beside it only.
            let with = [(comm.rank() + 1) % ranks, (comm.rank() + ranks - 1) % ranks];
            for round in 0..100 {
                let own = |to: usize| vec![comm.rank() as u8, to as u8, round];
                let received = comm.exchange(&with, with.map(own).to_vec()).unwrap();
                let expected = with.map(|from| vec![from as u8, comm.rank() as u8, round]);
                assert_eq!(received, expected);
            }
        });
    }

    #[test]
    fn all_ranks_agree() {
        for ranks in [1, 2, 3, 7] {
            let found = on_ranks(ranks, |comm| {
                let rank = comm.rank();
                let all = comm.gather(vec![rank as u8; rank]).unwrap();
                assert_eq!(all, (0..ranks).map(|rank| vec![rank as u8; rank]).collect::<Vec<_>>());
                let last = rank == ranks - 1;
                let least = comm.least(if last { -3.5 } else { f64::INFINITY }).unwrap();
                (least, comm.any(last).unwrap(), comm.any(false).unwrap())
            });
            assert_eq!(found, vec![(-3.5, true, false); ranks]);
        }
    }

    /// Values that round to something else when each rank makes a sum of its own first.
    #[test]
    fn sums_are_those_of_one_rank_bit_for_bit() {
        let cells: Vec<f64> = (0..200_u32).map(|n| f64::from(n * 37 % 101 + 1) / 7.0).collect();
        let expected: f64 = cells.iter().sum();
        let by_halves = cells[..77].iter().sum::<f64>() + cells[77..].iter().sum::<f64>();
        assert_ne!(expected.to_bits(), by_halves.to_bits(), "the values tell the ways apart");
        for cuts in [vec![0, 200], vec![0, 77, 200], vec![0, 10, 10, 150, 200]] {
            let found = on_ranks(cuts.len() - 1, |comm| {
                comm.sum(&cells[cuts[comm.rank()]..cuts[comm.rank() + 1]]).unwrap().to_bits()
            });
            assert_eq!(found, vec![expected.to_bits(); cuts.len() - 1]);
        }
    }

    #[test]
    fn whoever_waits_for_a_rank_that_ended_ends_too() {
        let found = on_ranks(3, |comm| match comm.rank() {
            // Rank 2 waits for rank 1 only, which waits for rank 0.
            0 => None,
            rank => comm.exchange(&[rank - 1], vec![vec![]]).err().map(|error| error.to_string()),
        });
        assert_eq!(found[0], None);
        assert_eq!(found[1].as_deref(), Some("rank 0 ended before the work was done"));
        assert!(found[2].as_deref().is_some_and(|what| what.contains("rank 1")), "{found:?}");
    }
}
