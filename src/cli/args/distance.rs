//! What was typed after `distance`: sources, grid, method, fields. What it means together is decided in `distance`.

use std::path::PathBuf;

use clap::builder::ArgPredicate;
use clap::{Args, ValueEnum};

use super::common::{OutputArgs, ResourceArgs};
use super::grid::GridArgs;
use super::values::{parse_method, parse_neighbours, solvers_help};
use crate::kernel::distance::state::neighbours::Neighbours;
use crate::pipeline::distance::Method;
use crate::pipeline::middle::{LabelMode, SurfaceKind};

/// Compute the distance to point clouds and triangle meshes on a grid of any size.
#[derive(Clone, Debug, Args)]
pub(crate) struct DistanceJobArgs {
    #[arg(required = true, value_name = "SOURCE", help = sources_help())]
    pub(crate) sources: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) job: FieldJobArgs,
    #[command(flatten)]
    pub(crate) choice: ChoiceArgs,
    /// Not distances but travel times through this image of speeds, a stack of any form that is read: each voxel holds the
    /// speed F at which a front passes it (length by time, 0 where nothing passes), and |grad T| = 1/F is solved, with fmm
    /// (where no method is named) or fsm. The grid is that of the image; what no front reaches is infinite; --labels follow the ways of the fronts
    #[arg(long, value_name = "IMAGE", help_heading = "Distance")]
    pub(crate) speed: Option<PathBuf>,
}

/// What is common to all that is made of a distance.
#[derive(Clone, Debug, Args)]
pub(crate) struct FieldJobArgs {
    #[command(flatten)]
    pub(crate) grid: GridArgs,
    #[command(flatten)]
    pub(crate) field: FieldArgs,
    #[command(flatten)]
    pub(crate) resources: ResourceArgs,
    /// Ranks that share the bricks, each a thread with files of its own; results do not depend on it
    #[arg(long, value_name = "N", default_value_t = 1, hide = true)]
    pub(crate) ranks: usize,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
}

/// How distance is computed.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Distance")]
pub(crate) struct FieldArgs {
    #[arg(long, value_name = "NAME", value_parser = parse_method, default_value = "vdt",
          default_value_if("speed", ArgPredicate::IsPresent, "fmm"), help = solvers_help())]
    pub(crate) method: Method,
    /// Order of the bricks: as distance reaches them; or the textbook's order, bit for bit: passes over all bricks
    /// (fsm, vdt), one heap over the whole volume in memory (fmm, dp)
    #[arg(long, value_enum, default_value_t = ScheduleArg::Front)]
    pub(crate) schedule: ScheduleArg,
    /// Whose sources a voxel is offered with vdt and dp: the 6 neighbours across its faces, or all 26, which loses
    /// fewer
    #[arg(long, value_name = "6|26", value_parser = parse_neighbours, default_value = "6")]
    pub(crate) neighbours: Neighbours,
    /// Iterations of eight passes each with --schedule sweep; fewer when one changes nothing
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) iterations: u32,
    /// Voxels that points fix: the corners of their cell, cubes so large that they touch, or a grid point alone
    #[arg(long, value_enum, default_value_t = InitArg::Cell)]
    pub(crate) init: InitArg,
    /// Type of the distances
    #[arg(long, value_enum, default_value_t = PrecisionArg::F32)]
    pub(crate) precision: PrecisionArg,
    /// As far as this length; voxels farther away hold it and have no label [default: everywhere]
    #[arg(long, value_name = "D", allow_hyphen_values = true)]
    pub(crate) max_distance: Option<f64>,
}

/// Which fields beside or instead of the plain distance.
#[derive(Clone, Copy, Debug, Default, Args)]
#[command(next_help_heading = "Distance")]
#[expect(clippy::struct_excessive_bools, reason = "each is asked for by itself")]
pub(crate) struct ChoiceArgs {
    /// Negative inside closed meshes
    #[arg(long)]
    pub(crate) signed: bool,
    /// Also write the label of the nearest data set: the n-th source file has label n
    #[arg(long)]
    pub(crate) labels: bool,
    /// Also write the position of the nearest source
    #[arg(long)]
    pub(crate) closest_point: bool,
    /// Without an error, of clouds and meshes: each voxel asks the sources that can be nearest, and no method is used
    #[arg(long, conflicts_with_all = ["method", "schedule", "neighbours", "iterations", "init"])]
    pub(crate) exact: bool,
}

/// In which order bricks are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ScheduleArg {
    /// As distance reaches them, each until nothing in it changes
    Front,
    /// As a textbook does it
    Sweep,
}

/// Which voxels points fix.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum InitArg {
    /// The corners of the cell that holds the point
    Cell,
    /// A cube as large as the widest gap between neighbouring points
    Contiguous,
    /// A point on a grid point that one alone, others as in cell
    Grid,
}

/// Type of the distances.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum PrecisionArg {
    /// 2 bytes
    F16,
    /// 4 bytes
    F32,
    /// 8 bytes
    F64,
}

/// The line of the help that lists the formats.
pub(crate) fn sources_help() -> String {
    let list: Vec<&str> = crate::io::geometry::read::sources::FORMATS.iter().map(|format| format.name).collect();
    format!(
        "Point clouds and triangle meshes ({}), and label volumes (TIFF, OME-Zarr, NRRD, VTI), told apart by content",
        list.join(", ")
    )
}

/// What `middle` asks for beside the distance.
#[derive(Clone, Debug)]
pub(crate) struct MiddleChoice {
    pub(crate) surface: SurfaceKind,
    pub(crate) labels: LabelMode,
    pub(crate) background: bool,
    pub(crate) mesh: Option<PathBuf>,
}
