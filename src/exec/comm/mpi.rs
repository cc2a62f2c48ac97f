//! `MpiComm`: ranks that are processes of an MPI program.
//!
//! MPI is called by one thread alone, the one that has begun it (what MPI calls funneled): it gets what is to be sent from
//! whoever drives the rank, and hands back what has come. So messages travel while others compute, and nobody else holds a
//! communicator.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crossbeam_channel::{Receiver, Sender, bounded, unbounded};
use mpi::Threading;
use mpi::point_to_point::MatchedReceiveVec;
use mpi::request::multiple_scope;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, Destination, Source};

use super::messages::Comm;
use crate::error::{Error, Result};

/// No single message of MPI is longer: its lengths are 32-bit numbers.
const LONGEST: usize = 1 << 30;
/// How long nobody looks whether something has come, where nothing has: MPI itself would keep a core busy.
const NAP: Duration = Duration::from_micros(50);
/// What stands before the bytes of a message: how many these are.
const HEAD: usize = 8;

/// This process among the others of an MPI program.
pub struct MpiComm {
    rank: usize,
    ranks: usize,
    to: Sender<Order>,
    /// What was ordered and has not been taken yet.
    waiting: Mutex<VecDeque<Receiver<Messages>>>,
}

/// A message for, or of, each of some ranks.
type Messages = Vec<Vec<u8>>;

/// What the thread that talks to MPI is to do.
enum Order {
    /// Sends to ranks, and takes what they send.
    Exchange { with: Vec<usize>, messages: Messages, answer: Sender<Messages> },
    /// Ends all processes at once.
    Abort(i32),
    /// Ends MPI; all ranks do.
    End(Sender<()>),
}

impl MpiComm {
    /// Begins MPI. Once in a process.
    ///
    /// # Errors
    /// When MPI cannot be begun.
    pub fn begin() -> Result<Self> {
        let (to, orders) = unbounded();
        let (tell, told) = bounded(1);
        let talk = move || talk(&orders, &tell);
        std::thread::Builder::new()
            .name("strandline-mpi".into())
            .spawn(talk)
            .map_err(|error| Error::from_io("cannot start a thread for MPI", &error))?;
        let began: Option<(usize, usize)> = told.recv().unwrap_or_default();
        let (rank, ranks) = began.ok_or_else(|| {
            Error::failed("MPI cannot be begun; was the program built for the MPI whose mpirun has started it?")
        })?;
        Ok(Self { rank, ranks, to, waiting: Mutex::default() })
    }

    /// Ends all processes of the program at once, with an exit code. From any thread.
    pub fn abort(&self, code: i32) {
        let _ = self.to.send(Order::Abort(code));
    }

    /// Waits until all ranks have come here, and ends MPI.
    pub fn end(&self) {
        let (tell, told) = bounded(1);
        if self.to.send(Order::End(tell)).is_ok() {
            let _ = told.recv();
        }
    }

    fn waiting(&self) -> MutexGuard<'_, VecDeque<Receiver<Messages>>> {
        // A list of channels is whole whatever thread was lost while holding it.
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Comm for MpiComm {
    fn rank(&self) -> usize {
        self.rank
    }

    fn ranks(&self) -> usize {
        self.ranks
    }

    fn post(&self, with: &[usize], messages: Vec<Vec<u8>>) -> Result<()> {
        let (answer, answered) = bounded(1);
        self.waiting().push_back(answered);
        self.to.send(Order::Exchange { with: with.to_vec(), messages, answer }).map_err(|_| gone())
    }

    fn collect(&self, _with: &[usize]) -> Result<Vec<Vec<u8>>> {
        let answered = self.waiting().pop_front();
        answered.ok_or_else(gone)?.recv().map_err(|_| gone())
    }
}

fn gone() -> Error {
    Error::failed("another rank ended before the work was done")
}

/// The thread that talks to MPI, from its begin to its end.
fn talk(orders: &Receiver<Order>, tell: &Sender<Option<(usize, usize)>>) {
    let Some((universe, _)) = mpi::initialize_with_threading(Threading::Funneled) else {
        let _ = tell.send(None);
        return;
    };
    let world = universe.world();
    let _ = tell.send(Some((world.rank() as usize, world.size() as usize)));
    while let Ok(order) = orders.recv() {
        match order {
            Order::Exchange { with, messages, answer } => {
                let answered = exchange(&world, &with, &messages, orders);
                let _ = answer.send(answered);
            }
            Order::Abort(code) => world.abort(code),
            Order::End(ended) => {
                drop(universe);
                let _ = ended.send(());
                return;
            }
        }
    }
}

/// Sends to each rank its message, and takes theirs, whatever order they come in.
fn exchange(world: &SimpleCommunicator, with: &[usize], messages: &[Vec<u8>], orders: &Receiver<Order>) -> Messages {
    let framed: Vec<Vec<u8>> = messages.iter().map(|message| framed(message)).collect();
    let mut received: Vec<Coming> = with.iter().map(|&rank| Coming { rank, bytes: Vec::new() }).collect();
    multiple_scope(with.len(), |scope, sends| {
        for (&rank, message) in with.iter().zip(&framed) {
            for piece in message.chunks(LONGEST) {
                sends.add(world.process_at_rank(rank as i32).immediate_send(scope, piece));
            }
        }
        while received.iter().any(|coming| !coming.is_whole()) {
            let mut has_come = false;
            for coming in received.iter_mut().filter(|coming| !coming.is_whole()) {
                has_come |= coming.look(world);
            }
            if !has_come {
                // Somebody may want all to end while others never come.
                if let Ok(Order::Abort(code)) = orders.try_recv() {
                    world.abort(code);
                }
                std::thread::sleep(NAP);
            }
        }
        sends.wait_all(&mut Vec::new());
    });
    received.into_iter().map(|coming| coming.bytes).map(unframed).collect()
}

/// A message with its length before it.
fn framed(message: &[u8]) -> Vec<u8> {
    let mut framed = Vec::with_capacity(HEAD + message.len());
    framed.extend_from_slice(&(message.len() as u64).to_le_bytes());
    framed.extend_from_slice(message);
    framed
}

fn unframed(mut framed: Vec<u8>) -> Vec<u8> {
    framed.drain(..HEAD);
    framed
}

/// What has come of a rank's message.
struct Coming {
    rank: usize,
    bytes: Vec<u8>,
}

impl Coming {
    fn is_whole(&self) -> bool {
        let head = self.bytes.first_chunk::<HEAD>();
        head.is_some_and(|head| self.bytes.len() as u64 == HEAD as u64 + u64::from_le_bytes(*head))
    }

    /// Takes the next piece, if it is there.
    fn look(&mut self, world: &SimpleCommunicator) -> bool {
        let Some(found) = world.process_at_rank(self.rank as i32).immediate_matched_probe() else { return false };
        let (mut piece, _) = found.matched_receive_vec::<u8>();
        if self.bytes.is_empty() {
            self.bytes = piece;
        } else {
            self.bytes.append(&mut piece);
        }
        true
    }
}
