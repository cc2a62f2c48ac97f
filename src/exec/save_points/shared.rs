//! The checkpoints of each rank of a run, of which the first one alone looks at the folder.

use crate::error::Result;
use crate::exec::comm::messages::Comm;
use crate::exec::comm::records::gather_records;
use crate::store::checkpoint::Checkpoints;

/// Gives each rank its checkpoints, where the first one, which alone has looked for some, `found` any. All ranks do.
///
/// # Errors
/// When the folder cannot be made or read, or another rank is gone.
pub fn share_checkpoints(comm: &dyn Comm, found: Option<Checkpoints>) -> Result<Option<Checkpoints>> {
    let (rank, ranks) = (comm.rank(), comm.ranks());
    if ranks == 1 {
        return Ok(found);
    }
    let (own, told) = found.map(|found| found.of_first(ranks)).transpose()?.unzip();
    let told = gather_records(comm, &told)?.into_iter().next().flatten();
    match (own, told) {
        (None, Some(told)) => Checkpoints::of_rank(told, rank, ranks).map(Some),
        (own, _) => Ok(own),
    }
}
