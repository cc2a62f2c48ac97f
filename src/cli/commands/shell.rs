//! `strandline completions` and `strandline man`: what shells and `man` know of the command line, made from it.

use std::path::Path;

use clap::CommandFactory;
use clap_complete::Shell;

use crate::cli::args::command_line::Cli;
use crate::cli::print;
use crate::error::{Error, Result};

/// Prints a shell's completions.
pub(crate) fn completions(shell: Shell) -> Result<()> {
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "strandline", &mut text);
    print(&String::from_utf8_lossy(&text))
}

/// Writes the manual pages into a folder.
pub(crate) fn manual(folder: &Path) -> Result<()> {
    let failed = |e: std::io::Error| Error::from_io("the manual pages cannot be written", &e).at(folder);
    std::fs::create_dir_all(folder).map_err(failed)?;
    clap_mangen::generate_to(Cli::command(), folder).map_err(failed)
}
