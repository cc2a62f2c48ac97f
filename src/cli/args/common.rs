//! What was typed: the flags, in groups that commands share. What they mean together is decided in `config`.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use super::pages::{PagesArgs, VolumesArgs};
use super::survive::SurviveArgs;
use super::times::Times;
use super::values::{
    CompressArg, Crop, OmeArg, Output, parse_crop, parse_fill_gaps, parse_method, parse_pair, parse_seed, parse_size,
    parse_triple, solvers_help,
};
use crate::pipeline::distance::Method;
use crate::pipeline::marks::Seed;
use crate::pipeline::segment::FillGaps;

/// Find objects in a 3-D image, guided by border points that were marked on it.
#[derive(Clone, Debug, Args)]
pub(crate) struct SegmentArgs {
    /// TIFF stack, a folder with one TIFF file for each slice, an OME-Zarr image, or an NRRD or VTI volume
    pub(crate) image: PathBuf,
    /// Border points: CSV (x,y,z and optionally object,contour,t; or tables of napari, Imaris and others), XYZ, PLY,
    /// ROIs (.roi, .zip); - reads standard input. Given several times, the n-th file is object n, and objects named in
    /// later files are numbered on from those of the earlier ones
    #[arg(long, required_unless_present = "seed", value_name = "CLOUD")]
    pub(crate) points: Vec<PathBuf>,
    /// What the numbers of the points are: voxel indices, the first one 0, or lengths [default: as the file's form says:
    /// voxels of napari and of ROIs, else lengths]
    #[arg(long, value_enum)]
    pub(crate) points_in: Option<PointsIn>,
    /// Object without points: a ball, centre and radius, from which the surface goes to the image's edges; several
    /// times for several objects, numbered on from those of the points
    #[arg(long, value_name = "X,Y,Z,R", value_parser = parse_seed, allow_hyphen_values = true)]
    pub(crate) seed: Vec<Seed>,
    #[command(flatten)]
    pub(crate) picture: ImageArgs,
    #[command(flatten)]
    pub(crate) motion: MotionArgs,
    #[command(flatten)]
    pub(crate) pull: PullArgs,
    #[command(flatten)]
    pub(crate) distance: DistanceArgs,
    #[command(flatten)]
    pub(crate) resources: ResourceArgs,
    /// Ranks that share the objects, each a thread with files of its own; results do not depend on it
    #[arg(long, value_name = "N", default_value_t = 1, hide = true)]
    pub(crate) ranks: usize,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
    #[command(flatten)]
    pub(crate) drawn: DrawnArgs,
}

/// Where the image lies and which part of it counts.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Image")]
pub(crate) struct ImageArgs {
    #[command(flatten)]
    pub(crate) volume: VolumesArgs,
    /// Time point of the image, counted from 0; all of them, or A:B for those from A up to B - 1: then one store with an axis of time,
    /// and each object from the marks of the nearest time at which it is marked (column t), moved as the image around it moved
    #[arg(long, value_name = "N|all|A:B", default_value_t = Times::One(0))]
    pub(crate) time: Times,
    /// Part of the image in voxels, ends excluded; an end left out is the image's [default: all of it]
    #[arg(long, value_name = "X0:X1,Y0:Y1,Z0:Z1", value_parser = parse_crop, allow_hyphen_values = true)]
    pub(crate) crop: Option<Crop>,
    /// Distance between voxel centres, physical [default: the file's]
    #[arg(long, value_name = "HX,HY,HZ", value_parser = parse_triple, allow_hyphen_values = true)]
    pub(crate) image_spacing: Option<[f64; 3]>,
    /// What the image shows at the border of the objects: `level`, inside and outside differ in brightness; `wall`, a
    /// bright or dark sheet runs along it; `edge`, the papers' edge detector; `none`, nothing to go by; `auto` finds
    /// out for each object from the grey values under its marks
    #[arg(long = "image", value_enum, default_value_t = ImageArg::Auto)]
    pub(crate) model: ImageArg,
    /// Where objects start: `auto`, as the shape of their outlines, or between the points of a cloud; `flood`, where a
    /// flood from outside ends, as in the papers
    #[arg(long, value_enum, default_value_t = StartArg::Auto)]
    pub(crate) start: StartArg,
    /// Leave out each outline in turn and tell how far its marks then lie from the shape, and which slice to mark next
    #[arg(long)]
    pub(crate) cross_validate: bool,
    /// Pull of the image's edges: the same at strong and weak ones, or as strong as they are
    #[arg(long, value_enum, default_value_t = Edge::Normalised)]
    pub(crate) edge: Edge,
    /// Smoothing before edges are looked for: a Gaussian, or one implicit step of the heat equation
    #[arg(long, value_enum, default_value_t = SmoothingArg::Gaussian)]
    pub(crate) smoothing: SmoothingArg,
    /// Percentages of the image's values that count as black and white
    #[arg(long, value_name = "LO,HI", value_parser = parse_pair, allow_hyphen_values = true, default_value = "0.1,99.9")]
    pub(crate) percentiles: [f64; 2],
    /// Leave the ends of stacked contours open: close nothing above the last and below the first
    #[arg(long)]
    pub(crate) no_caps: bool,
    /// Which object gets the voxels where several overlap
    #[arg(long, value_enum, default_value_t = OverlapArg::Smaller)]
    pub(crate) overlap: OverlapArg,
    /// Share out gaps between objects along the wall's crest: those up to a width, a length, or as wide as they are
    /// where objects face each other
    #[arg(long, value_name = "D|auto", value_parser = parse_fill_gaps, allow_hyphen_values = true)]
    pub(crate) fill_gaps: Option<FillGaps>,
}

/// How the surface moves.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Level set")]
pub(crate) struct MotionArgs {
    /// Weight of curvature, a length; smooths the surface [default: 0.1 of the smallest spacing]
    #[arg(long, value_name = "D", allow_hyphen_values = true)]
    pub(crate) delta: Option<f64>,
    /// Weight of the pull towards the points [default: 1]
    #[arg(long, value_name = "W", allow_hyphen_values = true)]
    pub(crate) theta: Option<f64>,
    /// Distance of the start surface from the points, a length [default: just beyond their largest hole]
    #[arg(long, value_name = "D", allow_hyphen_values = true)]
    pub(crate) beta: Option<f64>,
    /// Time step [default: 0.5 of the smallest spacing]
    #[arg(long, value_name = "T", allow_hyphen_values = true)]
    pub(crate) tau: Option<f64>,
    /// Regularisation of gradients, one over a length [default: 0.01 over the smallest spacing]
    #[arg(long, value_name = "E", allow_hyphen_values = true)]
    pub(crate) epsilon: Option<f64>,
    /// Relaxation factor of the linear solver, between 0 and 2 [default: 1.2]
    #[arg(long, value_name = "W", allow_hyphen_values = true)]
    pub(crate) omega: Option<f64>,
    /// What counts as rest: the surface's mean speed, or the L2 norm of a step's change
    #[arg(long, value_enum, default_value_t = StopArg::Surface)]
    pub(crate) stop: StopArg,
    /// Limit under which the surface rests [default: 0.02 for surface, 0.005 in `reconstruct`, 0.001 for l2]
    #[arg(long, value_name = "X", allow_hyphen_values = true)]
    pub(crate) tol: Option<f64>,
    /// Time steps at most [default: 60]
    #[arg(long, value_name = "N")]
    pub(crate) max_steps: Option<u32>,
}

/// How the image pulls at the surface.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Level set")]
pub(crate) struct PullArgs {
    /// Weight of the image; 0 leaves it out [default: 4 with outlines, 0.3 where edges pull]
    #[arg(long, value_name = "W", allow_hyphen_values = true)]
    pub(crate) rho: Option<f64>,
    /// Contrast of the edge detector, for intensities from 0 to 1 [default: 650]
    #[arg(long, value_name = "K", allow_hyphen_values = true)]
    pub(crate) k: Option<f64>,
    /// Width of the smoothing before borders are looked for, a length [default: 1 of the smallest spacing with outlines,
    /// 2 where edges pull]
    #[arg(long, value_name = "D", allow_hyphen_values = true)]
    pub(crate) sigma: Option<f64>,
}

/// How distance is computed.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Distance")]
pub(crate) struct DistanceArgs {
    #[arg(long, value_name = "NAME", value_parser = parse_method, default_value = "vdt", help = solvers_help())]
    pub(crate) method: Method,
}

/// What the run may use.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Resources")]
pub(crate) struct ResourceArgs {
    /// Memory limit: bytes, or with KiB, MiB, GiB, TiB (K, M, G, T mean the same) or kB, MB, GB, TB
    /// [default: half of what the machine or the control group has]
    #[arg(long, value_name = "SIZE", value_parser = parse_size)]
    pub(crate) memory: Option<u64>,
    /// Threads [default: one for each core]
    #[arg(long, value_name = "N")]
    pub(crate) threads: Option<usize>,
    /// Edge of the bricks, voxels, a multiple of 16 [default: 64; distance: 32, or 64 for fsm on large grids]
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    pub(crate) brick: Option<i64>,
    /// Folder for temporary fields, removed at the end [default: $TMPDIR, else the folder of the output]
    #[arg(long, value_name = "DIR")]
    pub(crate) scratch: Option<PathBuf>,
}

/// Where results go.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Output")]
#[allow(clippy::struct_excessive_bools, reason = "each is a flag of its own")]
pub(crate) struct OutputArgs {
    /// OME-Zarr store to write; none computes and reports, and writes no field
    #[arg(short, long = "output", value_name = "OUT.zarr|none", required = true)]
    pub(crate) output: Output,
    /// Replace outputs that are there already
    #[arg(long)]
    pub(crate) overwrite: bool,
    /// Let the store stand under its name from the start, readable while it fills; with --overwrite the one that is there
    /// goes at once
    #[arg(long)]
    pub(crate) live: bool,
    /// How the store's chunks are packed: as fast as a disk takes them, small (about a tenth smaller, several times
    /// slower), or not at all
    #[arg(long, value_enum, default_value_t = CompressArg::Fast)]
    pub(crate) compress: CompressArg,
    /// Version of OME-Zarr: 0.5 (Zarr 3, chunks together in shards), or 0.4 (Zarr 2, a file for each chunk) for programs that
    /// do not read 0.5, such as BDV and older Fiji
    #[arg(long, value_enum, default_value_t = OmeArg::V05)]
    pub(crate) ome: OmeArg,
    /// Write the report once more, as a file of its own
    #[arg(long, value_name = "FILE.json")]
    pub(crate) report: Option<PathBuf>,
    /// Read the inputs, print what a run would take, and stop
    #[arg(long)]
    pub(crate) dry_run: bool,
    /// Print nothing but errors
    #[arg(short, long, conflicts_with = "verbose")]
    pub(crate) quiet: bool,
    /// Print settings and each stage as it ends
    #[arg(short, long)]
    pub(crate) verbose: bool,
    /// How the run tells what it does: lines to read, or one JSON object an event
    #[arg(long, value_enum, default_value_t = LogArg::Text)]
    pub(crate) log: LogArg,
    #[command(flatten)]
    pub(crate) survive: SurviveArgs,
}

/// How events are told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum LogArg {
    Text,
    Json,
}

impl OutputArgs {
    /// The store's path, where there is to be one.
    pub(crate) fn store(&self) -> Option<&Path> {
        self.output.path()
    }
}

/// What is drawn of the objects beside the store.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Output")]
pub(crate) struct DrawnArgs {
    /// Write the surface once more, in a file of its own, in the format of its name; with several objects FILE-1.ply,
    /// FILE-2.ply, ..., with several times FILE-t0000.ply or FILE-t0000-1.ply, ...
    #[arg(long, value_name = "FILE.ply|obj|stl|vtp")]
    pub(crate) mesh: Option<PathBuf>,
    /// Draw three slices through the objects with their outlines
    #[arg(long, value_name = "FILE.png")]
    pub(crate) picture: Option<PathBuf>,
}

/// Segment the built-in stack of an early Arabidopsis embryo with default settings.
#[derive(Debug, Args)]
pub(crate) struct DemoArgs {
    /// OME-Zarr store to write; one that the demo made before is replaced
    #[arg(short, long = "output", value_name = "OUT.zarr", default_value = "strandline-demo.zarr")]
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) resources: ResourceArgs,
    /// Print nothing but errors
    #[arg(short, long)]
    pub(crate) quiet: bool,
    /// How the run tells what it does: lines to read, or one JSON object an event
    #[arg(long, value_enum, default_value_t = LogArg::Text)]
    pub(crate) log: LogArg,
}

/// Tell what an input or output is.
#[derive(Debug, Args)]
pub(crate) struct InfoArgs {
    /// TIFF stack, folder of slices, NRRD or VTI volume, border points (CSV, XYZ, PLY), OME-Zarr or OUT.zarr
    pub(crate) file: PathBuf,
    #[command(flatten)]
    pub(crate) pages: PagesArgs,
    /// Print JSON
    #[arg(long)]
    pub(crate) json: bool,
}

/// What the numbers of points are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum PointsIn {
    /// Indices of voxels
    Voxels,
    /// Lengths
    Physical,
}

/// How the image's edges pull.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Edge {
    /// By the direction of the edge alone
    Normalised,
    /// By the gradient of the edge detector
    Plain,
}

/// What the image shows at the border.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ImageArg {
    /// Found for each object
    Auto,
    /// Inside and outside differ in brightness
    Level,
    /// A sheet runs along the border
    Wall,
    /// The papers' edge detector
    Edge,
    /// The image is left out
    None,
}

/// Where objects start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum StartArg {
    /// As the shape of their outlines
    Auto,
    /// Where a flood from outside ends
    Flood,
}

/// Which object gets the voxels where several overlap.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum OverlapArg {
    /// The one with the smaller volume where it lies inside the larger: nested tissues; of neighbours the one that the
    /// voxel lies deeper in
    Smaller,
    /// The one with the larger volume
    Larger,
    /// The one with the lower number
    First,
    /// The one with the higher number
    Last,
}

/// How the image is smoothed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum SmoothingArg {
    /// The exact solution of the heat equation
    Gaussian,
    /// One implicit step, as in the papers: twice the noise at the same width, and slower
    Heat,
}

/// When the time loop ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum StopArg {
    /// The surface's mean speed falls under the limit
    Surface,
    /// The L2 norm of a step's change falls under the limit
    L2,
}
