//! `strandline middle`: the surface between labelled sources. Sources, grid, memory and output are those of `distance`.

use super::distance::{MiddleChoice, run_middle};
use super::distance_args::{ChoiceArgs, DistanceJobArgs};
use super::middle_args::{LabelsArg, MiddleArgs, SurfaceArg};
use crate::error::{Error, Result};
use crate::pipeline::middle::{LabelMode, SurfaceKind};

/// Runs the command.
pub(super) fn run(args: &MiddleArgs, typed: &[String]) -> Result<()> {
    if args.sources.len() < 2 {
        return Err(Error::usage("a middle surface lies between data sets; give two files or more"));
    }
    let MiddleArgs { sources, grid, field, surface, resources, ranks, output } = args.clone();
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
    let args = DistanceJobArgs { sources, grid, field, choice: fields, resources, ranks, output };
    run_middle(args, choice, typed)
}
