//! The store that a run writes, as its flags ask for it.

use crate::cli::args::common::OutputArgs;
use crate::error::Result;
use crate::exec::Engine;
use crate::io::ome_zarr::StoreWriter;
use crate::job::live::Telling;

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
