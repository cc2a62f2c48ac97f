//! The command line: what was typed (`args`), what it means (`config`), doing it (`segment`, `demo`, `info`).
//!
//! Results go to stdout, everything else to stderr. Exit codes: 0 done, 1 the run failed, 2 wrong usage or unusable
//! input, 130 interrupted, 143 terminated.

mod args;
pub(crate) mod command_line;
mod config;
mod console;
mod demo;
mod disk;
mod distance;
mod distance_args;
mod distance_report;
mod distance_sources;
mod drawing;
mod files;
mod grid;
mod grid_args;
mod info;
mod info_store;
mod input;
pub(crate) mod lines;
mod marks;
mod measure;
mod middle;
mod middle_args;
mod neighbours_report;
mod outputs;
mod pages_args;
mod picture;
mod reconstruct;
mod reconstruct_args;
mod report;
mod segment;
mod signals;
mod sources;
mod store_contents;
mod table;
mod text;
mod values;

use std::ffi::OsString;
use std::io::{ErrorKind, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;

use clap::Parser;

use crate::error::{Error, Result};
use command_line::{Cli, Command};

/// Runs the program with its arguments, the first of which is its own name.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let cli = match Cli::try_parse_from(&arguments) {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version go to stdout with code 0, complaints to stderr with code 2.
            let _ = error.print();
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
    };
    let typed: Vec<String> = arguments.iter().map(|a| a.to_string_lossy().into_owned()).collect();
    let ended = catch_unwind(AssertUnwindSafe(|| execute(cli, &typed)));
    if !signals::speak_last() {
        // The process ends in another thread, which says so.
        loop {
            std::thread::park();
        }
    }
    match ended {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(error)) => {
            let error = signals::seen(error);
            complain(&error.to_string());
            ExitCode::from(error.exit_code())
        }
        Err(_) => {
            complain("this is a fault of strandline; please report it with the lines above and the command");
            ExitCode::from(1)
        }
    }
}

fn execute(cli: Cli, typed: &[String]) -> Result<()> {
    match cli.command {
        Command::Segment(args) => segment::run(&args, typed),
        Command::Distance(args) => distance::run(&args, typed),
        Command::Middle(args) => middle::run(&args, typed),
        Command::Reconstruct(args) => reconstruct::run(&args, typed),
        Command::Demo(args) => demo::run(&args, typed),
        Command::Measure(args) => measure::run(&args),
        Command::Info(args) => info::run(&args),
    }
}

fn complain(message: &str) {
    // Nobody is left to tell when stderr is closed.
    let _ = writeln!(std::io::stderr(), "strandline: {message}");
}

/// Prints a result; a reader that went away is no failure of the run.
///
/// # Errors
/// When there is no room for it where it goes, such as a file on a full disk.
fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Error::from_io("the result cannot be printed", &error))
        }
        _ => Ok(()),
    }
}
