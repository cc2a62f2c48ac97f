//! The store that a run writes, as its flags ask for it.

use crate::cli::args::common::OutputArgs;
use crate::error::{Error, Result};
use crate::exec::{Engine, gather_records};
use crate::io::ome_zarr::{SharedStore, StoreWriter};
use crate::job::live::Telling;

/// Begins the store on the first rank; the others add to it.
///
/// # Errors
/// As [`StoreWriter::create`], and when another rank is gone.
pub(crate) fn begin_store_on_ranks(
    output: &OutputArgs,
    engine: &Engine,
) -> Result<(Option<StoreWriter>, Option<Telling>)> {
    let comm = engine.comm();
    let is_first = comm.rank() == 0;
    let (store, telling) = if is_first { begin_store(output, engine)? } else { (None, None) };
    if comm.ranks() == 1 {
        return Ok((store, telling));
    }
    let told = gather_records(comm, &store.as_ref().map(StoreWriter::share))?;
    let shared: Option<SharedStore> = told.into_iter().next().flatten();
    if is_first {
        return Ok((store, telling));
    }
    if let Some(shared) = shared.as_ref().filter(|shared| !shared.is_there()) {
        let what = "the store that rank 0 has begun is not to be seen here; all machines need the folder of the output under the same path";
        return Err(Error::failed(what).at(shared.path()));
    }
    Ok((shared.map(|shared| StoreWriter::shared(&shared).packed(output.compress.into())), None))
}

/// Tells the first rank what the others have written; these are done with the store then.
///
/// # Errors
/// When shards cannot be written out to the disk, or another rank is gone.
pub(crate) fn join_store(store: Option<StoreWriter>, engine: &Engine) -> Result<Option<StoreWriter>> {
    let comm = engine.comm();
    if comm.ranks() == 1 {
        return Ok(store);
    }
    // All have one, or none has.
    let Some(store) = store else { return Ok(None) };
    let sums = if comm.rank() == 0 { Vec::new() } else { store.sums() };
    let mut first = Some(store);
    if comm.rank() > 0
        && let Some(store) = first.take()
    {
        store.finish()?;
    }
    for sums in gather_records(comm, &sums)? {
        if let Some(store) = &first {
            store.take_sums(sums);
        }
    }
    Ok(first)
}

/// Begins the store, where there is to be one; one that is live says how far the run is, until what comes with it goes.
///
/// # Errors
/// As [`StoreWriter::create`].
pub(crate) fn begin_store(output: &OutputArgs, engine: &Engine) -> Result<(Option<StoreWriter>, Option<Telling>)> {
    let create = if output.live { StoreWriter::create_live_as } else { StoreWriter::create_as };
    let begin = |path| Ok(create(output.ome.into(), path, output.overwrite)?.packed(output.compress.into()));
    let store = output.store().map(begin).transpose()?;
    let telling = store.as_ref().and_then(|store| Telling::of(store, engine));
    Ok((store, telling))
}
