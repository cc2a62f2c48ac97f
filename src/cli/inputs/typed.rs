//! A command line as it was typed, flag by flag: what was given, and nothing of what a flag is without that.

use std::ffi::OsString;

use clap::builder::ValueParser;
use clap::parser::ValueSource;
use clap::{ArgMatches, Command, CommandFactory};

use crate::cli::args::command_line::Cli;

/// What was typed.
#[derive(Debug)]
pub(crate) struct Typed {
    /// The command's name.
    pub(crate) command: String,
    /// What it was given, in the order in which the command knows them.
    pub(crate) given: Vec<Given>,
}

/// A flag that was given, or inputs without one.
#[derive(Debug)]
pub(crate) struct Given {
    /// As the program calls it.
    pub(crate) id: String,
    /// As it is typed, without dashes; none of inputs.
    pub(crate) flag: Option<String>,
    /// Whether values follow it.
    pub(crate) takes_values: bool,
    /// Whether these are files or folders.
    pub(crate) is_path: bool,
    pub(crate) values: Vec<OsString>,
}

impl Given {
    /// As it is called where it is told.
    pub(crate) fn name(&self) -> String {
        self.flag.as_ref().map_or_else(|| self.id.to_uppercase(), |flag| format!("--{flag}"))
    }
}

impl Typed {
    /// Takes a command line apart, the program's name first.
    ///
    /// # Errors
    /// Where the program does not understand it.
    pub(crate) fn read(line: &[impl AsRef<str>]) -> Result<Self, clap::Error> {
        let program = Cli::command();
        let matches = program.clone().try_get_matches_from(line.iter().map(AsRef::as_ref))?;
        let Some((name, matches)) = matches.subcommand() else {
            return Ok(Self { command: String::new(), given: Vec::new() });
        };
        let arguments = program.find_subcommand(name).into_iter().flat_map(Command::get_arguments);
        let given = arguments.filter(|argument| is_given(matches, argument.get_id().as_str())).map(|argument| Given {
            id: argument.get_id().to_string(),
            flag: argument.get_long().map(ToOwned::to_owned),
            takes_values: argument.get_action().takes_values(),
            is_path: argument.get_value_parser().type_id() == ValueParser::path_buf().type_id(),
            values: matches.get_raw(argument.get_id().as_str()).into_iter().flatten().map(ToOwned::to_owned).collect(),
        });
        Ok(Self { command: name.to_owned(), given: given.collect() })
    }
}

fn is_given(matches: &ArgMatches, id: &str) -> bool {
    matches.try_contains_id(id).unwrap_or(false) && matches.value_source(id) == Some(ValueSource::CommandLine)
}
