//! What was typed after `distance`: sources, grid, method, fields. What it means together is decided in `distance`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::args::{PointsIn, ResourceArgs};
use super::pages_args::PagesArgs;
use super::values::{
    Output, parse_method, parse_neighbours, parse_spacing, parse_triple, parse_whole_triple, solvers_help,
};
use crate::kernel::distance::Neighbours;
use crate::pipeline::distance::Method;

/// Compute the distance to point clouds and triangle meshes on a grid of any size.
#[derive(Clone, Debug, Args)]
pub(super) struct DistanceJobArgs {
    #[arg(required = true, value_name = "SOURCE", help = sources_help())]
    pub(super) sources: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) job: FieldJobArgs,
    #[command(flatten)]
    pub(super) choice: ChoiceArgs,
}

/// What is common to all that is made of a distance.
#[derive(Clone, Debug, Args)]
pub(super) struct FieldJobArgs {
    #[command(flatten)]
    pub(super) grid: GridArgs,
    #[command(flatten)]
    pub(super) field: FieldArgs,
    #[command(flatten)]
    pub(super) resources: ResourceArgs,
    /// Ranks that share the bricks, each a thread with files of its own; results do not depend on it
    #[arg(long, value_name = "N", default_value_t = 1, hide = true)]
    pub(super) ranks: usize,
    #[command(flatten)]
    pub(super) output: FieldOutputArgs,
}

/// Where the grid lies.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Grid")]
pub(super) struct GridArgs {
    /// Distance between voxel centres, one for all axes or three [default: 1/256 of the longest side]
    #[arg(long, value_name = "H|HX,HY,HZ", value_parser = parse_spacing, allow_hyphen_values = true)]
    pub(super) spacing: Option<[f64; 3]>,
    /// Room around the sources, a length [default: 1/6 of their largest extent]
    #[arg(long, value_name = "D", allow_hyphen_values = true, conflicts_with_all = ["origin", "shape", "like"])]
    pub(super) padding: Option<f64>,
    /// Centre of the first voxel; with --shape
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_triple, allow_hyphen_values = true, requires = "shape")]
    pub(super) origin: Option<[f64; 3]>,
    /// Voxels along each axis; with --origin and --spacing
    #[arg(long, value_name = "NX,NY,NZ", value_parser = parse_whole_triple, allow_hyphen_values = true,
          requires_all = ["origin", "spacing"])]
    pub(super) shape: Option<[i64; 3]>,
    /// The grid of this image: TIFF stack, folder of slices or OME-Zarr; that of a label volume is taken without being asked for
    #[arg(long, value_name = "IMAGE", conflicts_with_all = ["spacing", "origin", "shape"])]
    pub(super) like: Option<PathBuf>,
    /// Distance between voxel centres of label volumes and of --like, in place of what the file says
    #[arg(long, value_name = "H|HX,HY,HZ", value_parser = parse_spacing, allow_hyphen_values = true)]
    pub(super) image_spacing: Option<[f64; 3]>,
    /// Channel of label volumes, counted from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(super) channel: u32,
    /// Time point of label volumes, counted from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(super) time: u32,
    /// Resolution of label volumes and of --like (OME-Zarr, TIFF with smaller copies of its pages), 0 the finest
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(super) level: u32,
    #[command(flatten)]
    pub(super) pages: PagesArgs,
    /// What the numbers of points are: voxel indices of the grid of --like (or of --origin, --shape and --spacing), the
    /// first one 0, or lengths [default: with --like as the file's form says: voxels of napari and of ROIs, else lengths]
    #[arg(long, value_enum)]
    pub(super) points_in: Option<PointsIn>,
}

/// How distance is computed.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Distance")]
pub(super) struct FieldArgs {
    #[arg(long, value_name = "NAME", value_parser = parse_method, default_value = "vdt", help = solvers_help())]
    pub(super) method: Method,
    /// Order of the bricks: as distance reaches them; or the textbook's order, bit for bit: passes over all bricks
    /// (fsm, vdt), one heap over the whole volume in memory (fmm, dp)
    #[arg(long, value_enum, default_value_t = ScheduleArg::Front)]
    pub(super) schedule: ScheduleArg,
    /// Whose sources a voxel is offered with vdt and dp: the 6 neighbours across its faces, or all 26, which loses
    /// fewer
    #[arg(long, value_name = "6|26", value_parser = parse_neighbours, default_value = "6")]
    pub(super) neighbours: Neighbours,
    /// Iterations of eight passes each with --schedule sweep; fewer when one changes nothing
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(super) iterations: u32,
    /// Voxels that points fix: the corners of their cell, cubes so large that they touch, or a grid point alone
    #[arg(long, value_enum, default_value_t = InitArg::Cell)]
    pub(super) init: InitArg,
    /// Type of the distances
    #[arg(long, value_enum, default_value_t = PrecisionArg::F32)]
    pub(super) precision: PrecisionArg,
    /// As far as this length; voxels farther away hold it [default: everywhere]
    #[arg(long, value_name = "D", allow_hyphen_values = true)]
    pub(super) max_distance: Option<f64>,
}

/// Which fields beside or instead of the plain distance.
#[derive(Clone, Copy, Debug, Default, Args)]
#[command(next_help_heading = "Distance")]
pub(super) struct ChoiceArgs {
    /// Negative inside closed meshes
    #[arg(long)]
    pub(super) signed: bool,
    /// Also write the label of the nearest data set: the n-th source file has label n
    #[arg(long)]
    pub(super) labels: bool,
    /// Also write the position of the nearest source
    #[arg(long)]
    pub(super) closest_point: bool,
}

/// Where results go.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Output")]
#[allow(clippy::struct_excessive_bools, reason = "each is a flag of its own")]
pub(super) struct FieldOutputArgs {
    /// OME-Zarr store to write; none computes and reports, and writes no field
    #[arg(short, long = "output", value_name = "OUT.zarr|none", required = true)]
    pub(super) output: Output,
    /// Replace outputs that are there already
    #[arg(long)]
    pub(super) overwrite: bool,
    /// Write the report once more, as a file of its own
    #[arg(long, value_name = "FILE.json")]
    pub(super) report: Option<PathBuf>,
    /// Read the sources, print what a run would take, and stop
    #[arg(long)]
    pub(super) dry_run: bool,
    /// Print nothing but errors
    #[arg(short, long, conflicts_with = "verbose")]
    pub(super) quiet: bool,
    /// Print settings and each stage as it ends
    #[arg(short, long)]
    pub(super) verbose: bool,
}

/// In which order bricks are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum ScheduleArg {
    /// As distance reaches them, each until nothing in it changes
    Front,
    /// As a textbook does it
    Sweep,
}

/// Which voxels points fix.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum InitArg {
    /// The corners of the cell that holds the point
    Cell,
    /// A cube as large as the widest gap between neighbouring points
    Contiguous,
    /// A point on a grid point that one alone, others as in cell
    Grid,
}

/// Type of the distances.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum PrecisionArg {
    /// 2 bytes
    F16,
    /// 4 bytes
    F32,
    /// 8 bytes
    F64,
}

/// The line of the help that lists the formats.
pub(super) fn sources_help() -> String {
    let list: Vec<&str> = crate::io::sources::FORMATS.iter().map(|format| format.name).collect();
    format!(
        "Point clouds and triangle meshes ({}), and label volumes (TIFF, OME-Zarr), told apart by content",
        list.join(", ")
    )
}
