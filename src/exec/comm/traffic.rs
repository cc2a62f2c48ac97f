//! What a rank says to others is counted as it passes: bytes, messages, and the seconds in which it waited for theirs.

use std::sync::Mutex;
use std::sync::PoisonError;
use std::time::Instant;

use super::messages::{Comm, RankTraffic};
use crate::error::Result;

/// A rank whose messages are counted.
pub struct Counted<C> {
    comm: C,
    traffic: Mutex<RankTraffic>,
}

impl<C: Comm> Counted<C> {
    /// Counts from nothing on.
    pub fn new(comm: C) -> Self {
        Self { comm, traffic: Mutex::default() }
    }

    fn count(&self, count: impl FnOnce(&mut RankTraffic)) {
        // Numbers are whole whatever thread was lost while holding them.
        count(&mut self.traffic.lock().unwrap_or_else(PoisonError::into_inner));
    }
}

impl<C: Comm> Comm for Counted<C> {
    fn rank(&self) -> usize {
        self.comm.rank()
    }

    fn ranks(&self) -> usize {
        self.comm.ranks()
    }

    fn post(&self, with: &[usize], messages: Vec<Vec<u8>>) -> Result<()> {
        self.count(|traffic| {
            traffic.bytes_sent += messages.iter().map(|message| message.len() as u64).sum::<u64>();
            traffic.messages += messages.iter().filter(|message| !message.is_empty()).count() as u64;
        });
        self.comm.post(with, messages)
    }

    fn collect(&self, with: &[usize]) -> Result<Vec<Vec<u8>>> {
        let started = Instant::now();
        let collected = self.comm.collect(with);
        self.count(|traffic| traffic.seconds_waiting += started.elapsed().as_secs_f64());
        collected
    }

    fn traffic(&self) -> RankTraffic {
        *self.traffic.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exec::ThreadComm;

    #[test]
    fn what_is_sent_is_counted_once_where_it_is_sent() {
        let sent: Vec<RankTraffic> = std::thread::scope(|scope| {
            let started: Vec<_> = ThreadComm::connected(3)
                .into_iter()
                .map(|comm| {
                    scope.spawn(move || {
                        let comm = Counted::new(comm);
                        let others: Vec<usize> = (0..3).filter(|&rank| rank != comm.rank()).collect();
                        let messages = others.iter().map(|&to| vec![0; 10 * comm.rank() * to]).collect();
                        comm.exchange(&others, messages).unwrap();
                        comm.traffic()
                    })
                })
                .collect();
            started.into_iter().map(|rank| rank.join().unwrap()).collect()
        });
        assert_eq!(sent.iter().map(|traffic| traffic.bytes_sent).collect::<Vec<_>>(), [0, 20, 20]);
        assert_eq!(sent.iter().map(|traffic| traffic.messages).collect::<Vec<_>>(), [0, 1, 1]);
        assert!(sent.iter().all(|traffic| traffic.seconds_waiting >= 0.0));
    }
}
