//! The flags by which a run survives its end: checkpoints, and going on from them.

use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use clap::Args;

/// How a run survives.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Survival")]
pub(crate) struct SurviveArgs {
    /// Folder of checkpoints, from which --resume goes on; off takes none [default: OUT.zarr.checkpoint, made when the first one is
    /// taken and removed at the end]
    #[arg(long, value_name = "DIR|off")]
    pub(crate) checkpoint: Option<Checkpoint>,
    /// How often checkpoints are taken, such as 10min or 30s [default: every 10min, and at the ends of stages, as long as they take less
    /// than a fortieth of the run]
    #[arg(long, value_name = "TIME", value_parser = parse_every)]
    pub(crate) checkpoint_every: Option<Duration>,
    /// Go on with a run that was ended, from its last checkpoint; with the same inputs and settings the result has the same bits
    #[arg(long)]
    pub(crate) resume: bool,
}

/// The longest time between checkpoints that can be meant.
const LONGEST: Duration = Duration::from_hours(365 * 24);

/// How often checkpoints are taken: never all the time, which would be all that the run does.
fn parse_every(text: &str) -> Result<Duration, String> {
    let what = "give a time from 1ms to 365days, such as 10min or 30s; --checkpoint off takes none";
    let time = humantime::parse_duration(text).map_err(|error| format!("{error}; {what}"))?;
    if (Duration::from_millis(1)..=LONGEST).contains(&time) { Ok(time) } else { Err(what.into()) }
}

/// Where checkpoints go.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Checkpoint {
    Off,
    Folder(PathBuf),
}

impl SurviveArgs {
    /// Whether checkpoints were asked for in so many words, rather than taken because nobody said anything.
    pub(crate) fn asks(&self) -> bool {
        self.resume || self.checkpoint_every.is_some() || matches!(self.checkpoint, Some(Checkpoint::Folder(_)))
    }
}

impl FromStr for Checkpoint {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text {
            "" => Err("an empty name; give a folder, or off"),
            "off" => Ok(Self::Off),
            folder => Ok(Self::Folder(folder.into())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_between_checkpoints_are_neither_nothing_nor_for_ever() {
        for (text, millis) in [("1ms", 1), ("10min", 600_000), ("1h 30m", 5_400_000), ("365days", 31_536_000_000)] {
            assert_eq!(parse_every(text), Ok(Duration::from_millis(millis)), "{text}");
        }
        for text in ["0s", "0ms", "1ns", "", "10", "-1s", "400days", "1000y", "1e3s", "99999999999999999999s", "off"] {
            assert!(parse_every(text).is_err_and(|told| told.contains("give a time from 1ms to 365days")), "{text}");
        }
    }
}
