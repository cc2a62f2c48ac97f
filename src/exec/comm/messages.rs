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

    /// Sends a message to the rank so many numbers further round, and returns that of the rank as many numbers before. All ranks do.
    ///
    /// # Errors
    /// When another rank is gone.
    fn round(&self, by: usize, message: Vec<u8>) -> Result<Vec<u8>> {
        let ranks = self.ranks();
        let (to, from) = ((self.rank() + by) % ranks, (self.rank() + ranks - by) % ranks);
        let received = if to == from {
            self.exchange(&[to], vec![message])
        } else {
            self.exchange(&[to, from], vec![message, Vec::new()])
        };
        received?.pop().ok_or_else(damaged)
    }

    /// What all ranks give, in order of their numbers: each passes on what it knows to one twice as far away each time (Bruck and
    /// others 1997), so it takes as many messages as the number of ranks has binary digits.
    ///
    /// # Errors
    /// When another rank is gone.
    fn gather(&self, own: Vec<u8>) -> Result<Vec<Vec<u8>>> {
        let (rank, ranks) = (self.rank(), self.ranks());
        // Of this rank, of the one before it, and so on.
        let mut known = vec![own];
        while known.len() < ranks {
            let by = known.len();
            let received = self.round(by, packed(&known[..by.min(ranks - by)]))?;
            let mut received = Message(&received);
            while !received.is_empty() {
                let length = u64::from_le_bytes(received.word()?);
                known.push(received.take(length as usize)?.to_vec());
            }
            if known.len() != ranks.min(2 * by) {
                return Err(damaged());
            }
        }
        Ok((0..ranks).map(|other| std::mem::take(&mut known[(rank + ranks - other) % ranks])).collect())
    }

    /// What all ranks agree on, where it does not matter how often each is asked, and in which order (dissemination; Hensgen and others
    /// 1988).
    ///
    /// # Errors
    /// When another rank is gone.
    fn agree(&self, own: f64, join: fn(f64, f64) -> f64) -> Result<f64> {
        let (mut known, mut by) = (own, 1);
        while by < self.ranks() {
            let received = self.round(by, known.to_le_bytes().to_vec())?;
            known = join(known, f64::from_le_bytes(Message(&received).word()?));
            by *= 2;
        }
        Ok(known)
    }

    /// The smallest of all ranks' values, none of them NaN.
    ///
    /// # Errors
    /// When another rank is gone.
    fn least(&self, value: f64) -> Result<f64> {
        self.agree(value, f64::min)
    }

    /// Whether any rank says yes.
    ///
    /// # Errors
    /// When another rank is gone.
    fn any(&self, value: bool) -> Result<bool> {
        Ok(self.agree(f64::from(u8::from(value)), f64::max)? > 0.0)
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

/// Messages one after the other, each with its length before it.
fn packed(messages: &[Vec<u8>]) -> Vec<u8> {
    let mut packed = Vec::with_capacity(messages.iter().map(|message| message.len() + 8).sum());
    for message in messages {
        packed.extend_from_slice(&(message.len() as u64).to_le_bytes());
        packed.extend_from_slice(message);
    }
    packed
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
