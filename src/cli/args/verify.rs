//! What was typed after `verify`.

use std::path::PathBuf;

use clap::Args;

use super::common::LogArg;
use super::values::parse_size;

/// Check a store: checksums of files, every chunk, and what of it follows from what else is in it.
#[derive(Clone, Debug, Args)]
pub(crate) struct VerifyArgs {
    /// OME-Zarr store that a run wrote
    #[arg(value_name = "OUT.zarr")]
    pub(crate) store: PathBuf,
    /// Run the command that the store's report names once more, with other threads, memory and bricks where these change
    /// nothing, into a hidden folder beside, and compare to the bit; in the folder that the command was given in
    #[arg(long)]
    pub(crate) rerun: bool,
    /// Memory limit: bytes, or with KiB, MiB, GiB, TiB (K, M, G, T mean the same) or kB, MB, GB, TB
    /// [default: half of what the machine or the control group has]
    #[arg(long, value_name = "SIZE", value_parser = parse_size, help_heading = "Resources")]
    pub(crate) memory: Option<u64>,
    /// Folder for the second run: what it writes and its temporary files [default: beside the store]
    #[arg(long, value_name = "DIR", requires = "rerun", help_heading = "Resources")]
    pub(crate) scratch: Option<PathBuf>,
    /// Threads [default: one for each core]
    #[arg(long, value_name = "N", help_heading = "Resources")]
    pub(crate) threads: Option<usize>,
    /// Print nothing but errors
    #[arg(short, long)]
    pub(crate) quiet: bool,
    /// How the run tells what it does: lines to read, or one JSON object an event
    #[arg(long, value_enum, default_value_t = LogArg::Text)]
    pub(crate) log: LogArg,
}
