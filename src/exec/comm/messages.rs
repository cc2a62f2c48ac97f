//! `Comm`: what ranks say to each other. One rank is a case of many: [`SelfComm`] is all there is to say to oneself.
//!
//! Every rank runs the same program on its own bricks. All of them make the same calls in the same order: after each
//! wave of bricks (neighbours on other ranks need the faces that changed), for each sum that decides something, and
//! before a shared decision. Messages are bytes, little-endian, so that they may leave the process.

use std::sync::Arc;

use crate::error::{Error, Result};

/// The ranks of a run.
///
/// A kind of ranks is [`Comm::post`] and [`Comm::collect`]; what all ranks agree on is made of them, and may be replaced
/// where there is something better.
pub trait Comm: Send + Sync {
    /// This rank's number, from 0.
    fn rank(&self) -> usize;

    /// Number of ranks.
    fn ranks(&self) -> usize;

    /// Sends to each rank of `with` the message at the same place, without waiting for it to be taken. Each of them must
    /// post too, naming this rank, and [`Comm::collect`] follows before the next post; messages of one rank arrive in the
    /// order in which it sent them.
    ///
    /// # Errors
    /// When another rank is gone.
    fn post(&self, with: &[usize], messages: Vec<Vec<u8>>) -> Result<()>;

    /// Waits for the messages that the ranks of `with` posted to this one, and returns them in the order of `with`.
    ///
    /// # Errors
    /// When another rank is gone.
    fn collect(&self, with: &[usize]) -> Result<Vec<Vec<u8>>>;

    /// Posts and collects at once.
    ///
    /// # Errors
    /// When another rank is gone.
    fn exchange(&self, with: &[usize], messages: Vec<Vec<u8>>) -> Result<Vec<Vec<u8>>> {
        self.post(with, messages)?;
        self.collect(with)
    }

    /// What was sent so far, where it is counted.
    fn traffic(&self) -> RankTraffic {
        RankTraffic::default()
    }

    /// The numbers of all other ranks.
    fn others(&self) -> Vec<usize> {
        (0..self.ranks()).filter(|&rank| rank != self.rank()).collect()
    }

    /// What all ranks give, in order of their numbers.
    ///
    /// # Errors
    /// When another rank is gone.
    fn gather(&self, own: Vec<u8>) -> Result<Vec<Vec<u8>>> {
        let others = self.others();
        let mut all = self.exchange(&others, vec![own.clone(); others.len()])?;
        all.insert(self.rank(), own);
        Ok(all)
    }

    /// The smallest of all ranks' values, none of them NaN.
    ///
    /// # Errors
    /// When another rank is gone.
    fn least(&self, value: f64) -> Result<f64> {
        let all = self.gather(value.to_le_bytes().to_vec())?;
        Ok(all.iter().flat_map(|bytes| numbers(bytes)).fold(f64::INFINITY, f64::min))
    }

    /// Whether any rank says yes.
    ///
    /// # Errors
    /// When another rank is gone.
    fn any(&self, value: bool) -> Result<bool> {
        Ok(self.gather(vec![u8::from(value)])?.concat().contains(&1))
    }

    /// The sum of all ranks' partial sums, given per cell in grid order and added in that order in f64: a rank's cells
    /// come after those of the ranks before it, so the bits are those of one rank that has them all.
    ///
    /// # Errors
    /// When another rank is gone.
    fn sum(&self, partial: &[f64]) -> Result<f64> {
        let all = self.gather(partial.iter().flat_map(|value| value.to_le_bytes()).collect())?;
        Ok(all.iter().flat_map(|bytes| numbers(bytes)).sum())
    }
}

impl<C: Comm + ?Sized> Comm for Arc<C> {
    fn rank(&self) -> usize {
        self.as_ref().rank()
    }

    fn ranks(&self) -> usize {
        self.as_ref().ranks()
    }

    fn post(&self, with: &[usize], messages: Vec<Vec<u8>>) -> Result<()> {
        self.as_ref().post(with, messages)
    }

    fn collect(&self, with: &[usize]) -> Result<Vec<Vec<u8>>> {
        self.as_ref().collect(with)
    }

    fn traffic(&self) -> RankTraffic {
        self.as_ref().traffic()
    }
}

/// What is left of a message that is read.
pub struct Message<'m>(pub &'m [u8]);

impl<'m> Message<'m> {
    /// Whether all of it was read.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The next bytes.
    ///
    /// # Errors
    /// When there are fewer.
    pub fn take(&mut self, len: usize) -> Result<&'m [u8]> {
        let (taken, rest) = self.0.split_at_checked(len).ok_or_else(damaged)?;
        self.0 = rest;
        Ok(taken)
    }

    /// The next bytes, of a number or several.
    ///
    /// # Errors
    /// When there are fewer.
    pub fn word<const N: usize>(&mut self) -> Result<[u8; N]> {
        self.take(N)?.try_into().map_err(|_| damaged())
    }
}

/// That a message is not what a rank of this version sends.
#[must_use]
pub(in crate::exec) fn damaged() -> Error {
    Error::failed("a message between ranks is damaged; all ranks must run the same version of the program")
}

fn numbers(bytes: &[u8]) -> impl Iterator<Item = f64> {
    bytes.as_chunks().0.iter().map(|word| f64::from_le_bytes(*word))
}

/// What a rank has sent, and how long it waited.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RankTraffic {
    /// Bytes sent to others.
    pub bytes_sent: u64,
    /// Messages with something in them.
    pub messages: u64,
    /// Wall time in which this rank waited for others.
    pub seconds_waiting: f64,
}

/// One rank that owns every brick: its neighbours' faces are already in its own arena.
#[derive(Clone, Copy, Debug, Default)]
pub struct SelfComm;

impl Comm for SelfComm {
    fn rank(&self) -> usize {
        0
    }

    fn ranks(&self) -> usize {
        1
    }

    fn post(&self, with: &[usize], _messages: Vec<Vec<u8>>) -> Result<()> {
        debug_assert!(with.is_empty(), "one rank has nobody to talk to");
        Ok(())
    }

    fn collect(&self, _with: &[usize]) -> Result<Vec<Vec<u8>>> {
        Ok(Vec::new())
    }
}
