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
    #[arg(long, value_name = "TIME", value_parser = humantime::parse_duration)]
    pub(crate) checkpoint_every: Option<Duration>,
    /// Go on with a run that was ended, from its last checkpoint; with the same inputs and settings the result has the same bits
    #[arg(long)]
    pub(crate) resume: bool,
}

/// Where checkpoints go.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Checkpoint {
    Off,
    Folder(PathBuf),
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
