//! `strandline middle`: the surface between labelled sources. Sources, grid, memory and output are those of `distance`; walls alone between
//! the labels of a volume need no distance (`walls`).

use super::distance::run_middle;
use super::walls;
use crate::cli::args::distance::MiddleChoice;
use crate::cli::args::distance::{ChoiceArgs, DistanceJobArgs};
use crate::cli::args::middle::{LabelsArg, MiddleArgs, SurfaceArg};
use crate::cli::inputs::sources::open_volume;
use crate::cli::terminal::console::{Console, Voice};
use crate::cli::terminal::signals;
use crate::error::{Error, Result};
use crate::io::stack::label_volume::is_label_volume;
use crate::pipeline::middle::{LabelMode, SurfaceKind, is_full};

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
        background: surface.background,
        mesh: surface.mesh,
    };
    let fields = ChoiceArgs { labels: true, ..ChoiceArgs::default() };
    let job = DistanceJobArgs { sources, job, choice: fields, speed: None };
    if has_walls_alone(&job, &choice)? { walls::run(job, &choice, typed) } else { run_middle(job, &choice, typed) }
}

/// Whether there is nothing between labels but where their voxels touch.
fn has_walls_alone(args: &DistanceJobArgs, choice: &MiddleChoice) -> Result<bool> {
    let volume = match args.sources.as_slice() {
        [only] if is_label_volume(only) => Some(only),
        _ => None,
    };
    let grid = args.job.grid.is_asked_for() || args.job.grid.like.is_some();
    let is_plain = volume.is_some() && !grid && choice.surface == SurfaceKind::Exact;
    if choice.background && !is_plain {
        return Err(Error::usage(
            "--background draws surfaces around the labels of one label volume, on its own voxels; leave out other sources, --surface labels \
             and what lays another grid",
        ));
    }
    let Some(path) = volume.filter(|_| is_plain) else { return Ok(false) };
    if choice.background {
        return Ok(true);
    }
    // Whoever runs the job tells what there is to be told of the file.
    let volume = open_volume(path, &args.job.grid, &Console::new(Voice::Quiet))?;
    let cancel = signals::cancel_on_signals()?;
    is_full(&volume, || cancel.check()).map_err(|error| error.at(path))
}
