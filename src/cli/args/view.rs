//! The flags of `strandline view`.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

/// Look at results in the browser.
#[derive(Debug, Args)]
pub(crate) struct ViewArgs {
    /// Store, folder of several, OME-Zarr 0.4 or 0.5 of another program, or mesh
    #[arg(value_name = "OUT.zarr")]
    pub(crate) path: PathBuf,
    /// Only serve: open no browser
    #[arg(long)]
    pub(crate) no_open: bool,
    /// Port on this machine [default: a free one]
    #[arg(long, value_name = "N")]
    pub(crate) port: Option<u16>,
    /// End after so long, such as 10min or 2h [default: at Ctrl-C]
    #[arg(long = "for", value_name = "TIME", value_parser = humantime::parse_duration)]
    pub(crate) within: Option<Duration>,
    /// Print links and commands for other programs: a neuroglancer elsewhere, napari, Fiji and others
    #[arg(long)]
    pub(crate) print_links: bool,
}
