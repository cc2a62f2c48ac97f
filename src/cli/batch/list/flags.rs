//! Keys of a list as flags of a command: which there are and what they take is asked of the command line itself, which also
//! reads what comes out, so that every flag has its own name, its own checks and its own words.

use std::any::TypeId;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::error::ErrorKind;
use clap::{Arg, ArgAction, CommandFactory, Parser};

use super::manifest::Given;
use crate::cli::args::command_line::{Cli, Command};
use crate::cli::args::common::ResourceArgs;

/// Keys that are the batch's to give.
const ITS_OWN: [&str; 9] =
    ["output", "overwrite", "report", "log", "dry_run", "quiet", "verbose", "resume", "checkpoint"];

/// A command that an item may be of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Segment,
    Reconstruct,
    Distance,
    Middle,
}

impl Kind {
    pub(crate) const ALL: [Self; 4] = [Self::Segment, Self::Reconstruct, Self::Distance, Self::Middle];

    pub(crate) fn named(name: &str) -> Result<Self, String> {
        match name {
            "segment" => Ok(Self::Segment),
            "reconstruct" => Ok(Self::Reconstruct),
            "distance" => Ok(Self::Distance),
            "middle" => Ok(Self::Middle),
            other => Err(format!("`{other}` is no command of items; give segment, reconstruct, distance or middle")),
        }
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Segment => "segment",
            Self::Reconstruct => "reconstruct",
            Self::Distance => "distance",
            Self::Middle => "middle",
        }
    }

    /// The key of what it works on.
    pub(crate) fn inputs(self) -> &'static str {
        if self == Self::Segment { "images" } else { "sources" }
    }

    /// Whether an item may have several sources.
    pub(crate) fn takes_several(self) -> bool {
        matches!(self, Self::Distance | Self::Middle)
    }
}

/// What a command line that was read says to run it by.
#[derive(Debug)]
pub(crate) struct Read {
    /// All files that it reads.
    pub(crate) files: Vec<PathBuf>,
    /// Files that it writes beside the store.
    pub(crate) writes: Vec<PathBuf>,
    pub(crate) resources: ResourceArgs,
}

/// The flags of one command.
pub(crate) struct Flags {
    kind: Kind,
    command: clap::Command,
}

impl Flags {
    pub(crate) fn of(kind: Kind) -> Self {
        let mut all = Cli::command();
        let command = all.find_subcommand_mut(kind.name()).map(std::mem::take).unwrap_or_default();
        Self { kind, command }
    }

    /// The words of a key on the command line; paths are relative to `folder`.
    pub(crate) fn words(&self, name: &str, given: &Given, folder: &Path) -> Result<Vec<OsString>, String> {
        let kind = self.kind.name();
        if ITS_OWN.contains(&name) {
            return Err(format!("`{name}` is for batch to give; leave it out of items"));
        }
        let flag = name.replace('_', "-");
        let Some(arg) = self.argument(name) else {
            return Err(format!(
                "unknown key `{name}`; the flags of {kind}, with _ for -, are in `strandline {kind} --help`"
            ));
        };
        let path = arg.get_value_parser().type_id() == TypeId::of::<PathBuf>();
        let one = |given: &Given| -> Result<OsString, String> {
            let text = flat(given).ok_or_else(|| format!("`{name}` takes a value, or a list of values"))?;
            // Standard input is nobody's.
            if path && text == "-" {
                return Err(format!("`{name}` is standard input, which items of a batch have not; name a file"));
            }
            Ok(if path { folder.join(text).into() } else { text.into() })
        };
        let with = |value: OsString| {
            let mut word = OsString::from(format!("--{flag}="));
            word.push(value);
            word
        };
        let may_stand_alone = arg.get_num_args().is_some_and(|range| range.min_values() == 0);
        match (given, arg.get_action().takes_values()) {
            (Given::Flag(is_set), takes) if !takes || may_stand_alone => {
                Ok(if *is_set { vec![format!("--{flag}").into()] } else { Vec::new() })
            }
            (_, false) => Err(format!("`{name}` is true or false, not {}", given.told())),
            (Given::Flag(_), true) => Err(format!("`{name}` takes a value, not true or false")),
            (Given::List(all), true) if matches!(arg.get_action(), ArgAction::Append) && !are_numbers(all) => {
                all.iter().map(|given| one(given).map(with)).collect()
            }
            _ => Ok(vec![with(one(given)?)]),
        }
    }

    /// Whether the command has a flag of that name.
    pub(crate) fn knows(&self, name: &str) -> bool {
        self.argument(name).is_some()
    }

    /// Whether neither the command nor batch has anything of that name.
    pub(crate) fn is_unknown(&self, name: &str) -> bool {
        !self.knows(name) && !ITS_OWN.contains(&name)
    }

    fn argument(&self, name: &str) -> Option<&Arg> {
        let flag = name.replace('_', "-");
        let is_one = !name.contains('-') && !["help", "version"].contains(&name);
        self.command.get_arguments().find(|arg| is_one && arg.get_long() == Some(&flag))
    }

    /// What is wrong with some words whatever stands beside them.
    pub(crate) fn wrong_alone(&self, words: &[OsString]) -> Option<String> {
        let error =
            self.read(words, &["a".into(), "b".into()][..if self.kind.takes_several() { 2 } else { 1 }]).err()?;
        // Others are of what is given together, which this is not.
        let is_of_all = matches!(error.kind(), ErrorKind::MissingRequiredArgument | ErrorKind::ArgumentConflict);
        (!is_of_all).then(|| sentence(&error))
    }

    /// What all words mean together, before `inputs`.
    pub(crate) fn read_all(&self, words: &[OsString], inputs: &[PathBuf]) -> Result<Read, String> {
        let cli = self.read(words, inputs).map_err(|error| sentence(&error))?;
        let (files, writes, resources) = match cli.command {
            Command::Segment(args) => {
                let writes = [args.drawn.mesh, args.drawn.picture];
                ([vec![args.image], args.points].concat(), writes.to_vec(), args.resources)
            }
            Command::Distance(args) => {
                let grids = args.job.grid.like.into_iter().chain(args.speed).collect();
                ([args.sources, grids].concat(), Vec::new(), args.job.resources)
            }
            Command::Middle(args) => {
                let like = args.job.grid.like.into_iter().collect();
                ([args.sources, like].concat(), vec![args.surface.mesh], args.job.resources)
            }
            Command::Reconstruct(args) => (vec![args.cloud], vec![args.mesh], args.resources),
            _ => return Err("is no command of items".into()),
        };
        Ok(Read { files, writes: writes.into_iter().flatten().collect(), resources })
    }

    fn read(&self, words: &[OsString], inputs: &[PathBuf]) -> Result<Cli, clap::Error> {
        let start = ["strandline", self.kind.name(), "--output=none"].map(OsString::from);
        let end = std::iter::once(OsString::from("--")).chain(inputs.iter().map(Into::into));
        Cli::try_parse_from(start.into_iter().chain(words.iter().cloned()).chain(end))
    }
}

/// One value as it is typed: lists with commas between.
fn flat(given: &Given) -> Option<String> {
    match given {
        Given::Flag(_) => None,
        Given::Number(text) | Given::Text(text) => Some(text.clone()),
        Given::List(all) => {
            let plain = |given: &Given| if matches!(given, Given::List(_)) { None } else { flat(given) };
            all.iter().map(plain).collect::<Option<Vec<_>>>().map(|all| all.join(","))
        }
    }
}

/// A list of numbers alone is one value, also of flags that may be given several times.
fn are_numbers(all: &[Given]) -> bool {
    !all.is_empty() && all.iter().all(|given| matches!(given, Given::Number(_)))
}

/// The first paragraph of a complaint, on one line.
fn sentence(error: &clap::Error) -> String {
    let text = error.to_string();
    let first = text.split("\n\n").next().unwrap_or_default();
    let words: Vec<&str> = first.split_whitespace().collect();
    words.join(" ").trim_start_matches("error: ").to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(kind: Kind, name: &str, given: &Given) -> Result<Vec<String>, String> {
        let words = Flags::of(kind).words(name, given, Path::new("/jobs"))?;
        Ok(words.into_iter().map(|word| word.into_string().unwrap()).collect())
    }

    #[test]
    fn keys_become_flags() {
        let number = |text: &str| Given::Number(text.into());
        let text = |text: &str| Given::Text(text.into());
        let list = |all: &[Given]| Given::List(all.to_vec());
        let one = |name, given| words(Kind::Segment, name, &given).unwrap();
        assert_eq!(one("rho", number("0.3")), ["--rho=0.3"]);
        assert_eq!(one("no_caps", Given::Flag(true)), ["--no-caps"]);
        assert!(one("no_caps", Given::Flag(false)).is_empty());
        assert_eq!(one("points", text("a.csv")), ["--points=/jobs/a.csv"]);
        assert_eq!(
            one("points", list(&[text("a.csv"), text("b.csv")])),
            ["--points=/jobs/a.csv", "--points=/jobs/b.csv"]
        );
        assert_eq!(one("seed", list(&["1", "2", "3", "4"].map(number))), ["--seed=1,2,3,4"]);
        let balls = list(&[list(&["1", "2", "3", "4"].map(number)), text("5,6,7,8")]);
        assert_eq!(one("seed", balls), ["--seed=1,2,3,4", "--seed=5,6,7,8"]);
        assert_eq!(one("image_spacing", list(&["1", "2", "3"].map(number))), ["--image-spacing=1,2,3"]);
        let isolated = |given| words(Kind::Reconstruct, "drop_isolated", &given).unwrap();
        assert_eq!(
            (isolated(Given::Flag(true)), isolated(number("5"))),
            (vec!["--drop-isolated".into()], vec!["--drop-isolated=5".into()])
        );
        for (name, given) in [
            ("output", text("x")),
            ("no-caps", Given::Flag(true)),
            ("help", Given::Flag(true)),
            ("no_caps", number("1")),
            ("rho", Given::Flag(true)),
            ("points", text("-")),
            ("spacing", number("1")),
        ] {
            assert!(words(Kind::Segment, name, &given).is_err(), "{name}");
        }
    }

    #[test]
    fn every_flag_of_every_command_is_a_key_or_batchs_own() {
        for kind in Kind::ALL {
            let flags = Flags::of(kind);
            let names: Vec<String> =
                flags.command.get_arguments().filter_map(Arg::get_long).map(|long| long.replace('-', "_")).collect();
            assert!(names.len() > 10);
            for name in names.iter().filter(|name| !["help", "version"].contains(&name.as_str())) {
                let known = [Given::Flag(true), Given::Number("1".into())]
                    .iter()
                    .any(|given| flags.words(name, given, Path::new("")).is_ok());
                assert_eq!(known, !ITS_OWN.contains(&name.as_str()), "{name}");
            }
        }
    }
}
