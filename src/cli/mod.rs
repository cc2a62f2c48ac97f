//! The command line: what was typed (`args`), what it means (`config`), doing it (`segment`, `demo`, `info`).
//!
//! Results go to stdout, everything else to stderr. Exit codes: 0 done, 1 the run failed, 2 wrong usage or unusable
//! input, 3 some of several items failed, 130 interrupted, 143 terminated.

mod args;
mod batch;
mod commands;
mod inputs;
mod outputs;
mod report;
mod terminal;

use std::ffi::OsString;
use std::io::{ErrorKind, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;

use clap::Parser;

use crate::error::{Error, Result};
use args::command_line::{Cli, Command};

/// Runs the program with its arguments, the first of which is its own name.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    terminal::parent::end_with_parent();
    let cli = match Cli::try_parse_from(&arguments) {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version go to stdout with code 0, complaints to stderr with code 2.
            let code = error.exit_code();
            if asks_for_json(&arguments) && code != 0 {
                terminal::log::event("error", serde_json::json!({ "text": error.to_string(), "code": code }));
            } else {
                let _ = error.print();
            }
            return ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(2));
        }
    };
    if cli.command.tells_json() {
        terminal::log::be_json();
    }
    let typed: Vec<String> = arguments.iter().map(|a| a.to_string_lossy().into_owned()).collect();
    let ended = catch_unwind(AssertUnwindSafe(|| {
        terminal::signals::listen_for_wishes()?;
        terminal::world::check(&cli.command)?;
        execute(cli, &typed)
    }));
    if !terminal::signals::speak_last() {
        // The process ends in another thread, which says so.
        loop {
            std::thread::park();
        }
    }
    let code = match ended {
        Ok(Ok(())) => {
            terminal::log::success();
            0
        }
        Ok(Err(error)) => {
            let error = terminal::signals::seen(error);
            terminal::world::give_way();
            tell(&error);
            error.exit_code()
        }
        Err(_) => {
            complain("this is a fault of strandline; please report it with the lines above and the command");
            1
        }
    };
    terminal::world::leave(code);
    ExitCode::from(code)
}

/// Whether events are to be lines of JSON, of a command that is not understood.
fn asks_for_json(arguments: &[OsString]) -> bool {
    arguments.iter().any(|argument| argument == "--log=json")
        || arguments.windows(2).any(|two| two[0] == "--log" && two[1] == "json")
}

fn execute(cli: Cli, typed: &[String]) -> Result<()> {
    match cli.command {
        Command::Segment(args) => commands::segment::run(&args, typed),
        Command::Distance(args) => commands::distance::run(&args, typed),
        Command::Middle(args) => commands::middle::run(&args, typed),
        Command::Reconstruct(args) => commands::reconstruct::run(&args, typed),
        Command::Batch(args) => commands::batch::run(&args),
        Command::Demo(args) => commands::demo::run(&args, typed),
        Command::Convert(args) => commands::convert::run(&args),
        Command::Measure(args) => commands::measure::run(&args),
        Command::Info(args) => commands::info::run(&args),
        Command::Verify(args) => commands::verify::run(&args),
        #[cfg(feature = "viewer")]
        Command::View(args) => commands::view::run(&args),
        Command::Completions { shell } => commands::shell::completions(shell),
        Command::Man { folder } => commands::shell::manual(&folder),
    }
}

/// Says on stderr why a run failed, in the form that was asked for.
fn tell(error: &Error) {
    if terminal::log::is_json() { terminal::log::failure(error) } else { complain(&error.to_string()) }
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
