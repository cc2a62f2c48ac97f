//! Work of which ranks share out the items, and all of them get all results.

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::comm::records::join_records;
use super::engine::Stage;
use super::workers::Workers;
use crate::error::Result;

/// `work` for each of the items, which all ranks have alike: each does an equal run of them, and all get all results, in order.
///
/// # Errors
/// The first failure of `work` on this rank, the signal that ended the run, or when another rank is gone.
pub fn run_shared<I, W, R>(
    stage: &Stage<'_>,
    items: &[I],
    workers: &Workers<W>,
    work: impl Fn(&mut W, &I) -> Result<R> + Sync,
) -> Result<Vec<R>>
where
    I: Sync,
    W: Send,
    R: Send + Serialize + DeserializeOwned,
{
    let comm = stage.comm();
    let cut = |rank: usize| items.len() * rank / comm.ranks();
    let own = stage.run(&items[cut(comm.rank())..cut(comm.rank() + 1)], workers, work)?;
    Ok(join_records(comm, own)?.0)
}
