//! `strandline middle`: the surface between labelled sources. Sources, grid, memory and output are those of `distance`.

use super::distance::run_middle;
use crate::cli::args::distance::MiddleChoice;
use crate::cli::args::distance::{ChoiceArgs, DistanceJobArgs};
use crate::cli::args::middle::{LabelsArg, MiddleArgs, SurfaceArg};
use crate::error::{Error, Result};
use crate::io::stack::label_volume::is_label_volume;
use crate::pipeline::middle::{LabelMode, SurfaceKind};

/// Runs the command.
pub(crate) fn run(args: &MiddleArgs, typed: &[String]) -> Result<()> {
    if args.sources.len() < 2 && !args.sources.iter().any(|path| is_label_volume(path)) {
        return Err(Error::usage("a middle surface lies between data sets; give two files or more, or a label volume"));
    }
    let MiddleArgs { sources, job, surface } = args.clone();
    let choice = MiddleChoice {
        surface: match surface.surface {
            SurfaceArg::Exact => SurfaceKind::Exact,
            SurfaceArg::Labels => SurfaceKind::Labels,
        },
        labels: match surface.labels {
            LabelsArg::Tracked => LabelMode::Tracked,
            LabelsArg::Exact => LabelMode::Exact,
        },
        mesh: surface.mesh,
    };
    let fields = ChoiceArgs { labels: true, ..ChoiceArgs::default() };
    run_middle(DistanceJobArgs { sources, job, choice: fields }, &choice, typed)
}
