//! Records that ranks tell each other, packed as those of checkpoints are.

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::messages::{Comm, damaged};
use crate::error::{Error, Result};
use crate::store::checkpoint::{pack, unpack};

/// A record as a message.
///
/// # Errors
/// When it has no such form.
pub fn pack_message<R: Serialize>(record: &R) -> Result<Vec<u8>> {
    pack(record).map_err(|error| Error::failed(format!("a message to other ranks cannot be made: {error}")))
}

/// A record out of a message.
///
/// # Errors
/// When it is no such record.
pub fn unpack_message<R: DeserializeOwned>(message: &[u8]) -> Result<R> {
    unpack(message).map_err(|_| damaged())
}

/// What all ranks tell, in order of their numbers.
///
/// # Errors
/// When another rank is gone.
pub fn gather_records<R: Serialize + DeserializeOwned>(comm: &dyn Comm, own: &R) -> Result<Vec<R>> {
    comm.gather(pack_message(own)?)?.iter().map(|message| unpack_message(message)).collect()
}

/// The records of all ranks, one after the other in order of these, and where this rank's own begin.
///
/// # Errors
/// When another rank is gone.
pub fn join_records<R: Serialize + DeserializeOwned>(comm: &dyn Comm, own: Vec<R>) -> Result<(Vec<R>, usize)> {
    if comm.ranks() == 1 {
        return Ok((own, 0));
    }
    let all: Vec<Vec<R>> = gather_records(comm, &own)?;
    drop(own);
    let first = all[..comm.rank()].iter().map(Vec::len).sum();
    Ok((all.into_iter().flatten().collect(), first))
}
