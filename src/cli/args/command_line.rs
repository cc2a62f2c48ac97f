//! The commands of the program, each with its flags.

use clap::{Parser, Subcommand};

use super::batch::BatchArgs;
use super::common::{DemoArgs, InfoArgs, LogArg, SegmentArgs};
use super::convert::ConvertArgs;
use super::distance::DistanceJobArgs;
use super::measure::MeasureArgs;
use super::middle::MiddleArgs;
use super::reconstruct::ReconstructArgs;
use super::verify::VerifyArgs;
#[cfg(feature = "viewer")]
use super::view::ViewArgs;

/// Finds surfaces in 3-D volumes larger than memory.
#[derive(Debug, Parser)]
#[command(name = "strandline", version, max_term_width = 100, arg_required_else_help = true)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Find objects in a 3-D image, guided by border points
    #[command(after_help = HELP_ON_SEGMENT)]
    Segment(Box<SegmentArgs>),
    /// Compute the distance to point clouds and triangle meshes
    #[command(after_help = HELP_ON_DISTANCE)]
    Distance(Box<DistanceJobArgs>),
    /// Compute the surface equally far from labelled point clouds and triangle meshes
    #[command(after_help = HELP_ON_DISTANCE)]
    Middle(Box<MiddleArgs>),
    /// Reconstruct a closed surface from a point cloud, without normals
    #[command(after_help = HELP_ON_DISTANCE)]
    Reconstruct(Box<ReconstructArgs>),
    /// Run many items of a list, several at a time; run again what is missing, failed or changed
    #[command(after_help = HELP_ON_BATCH)]
    Batch(Box<BatchArgs>),
    /// Segment the built-in stack of a plant embryo
    Demo(DemoArgs),
    /// Write a volume or a mesh in another format: OME-Zarr 0.4 or 0.5, OME-TIFF, VTI, NRRD; PLY, OBJ, STL, VTP
    #[command(after_help = HELP_ON_DISTANCE)]
    Convert(Box<ConvertArgs>),
    /// Measure a triangle mesh: volume, area, pieces, holes, and how far points lie from it
    Measure(MeasureArgs),
    /// Tell what an input or output is: shape, axes, spacing, unit, type
    Info(InfoArgs),
    /// Check a store: checksums, every chunk, pyramids, and labels and meshes against the fields they are of
    #[command(after_help = HELP_ON_VERIFY)]
    Verify(VerifyArgs),
    /// Look at results in the browser: stores, OME-Zarr of other programs, meshes
    #[cfg(feature = "viewer")]
    View(ViewArgs),
    /// Print what a shell needs to complete commands and flags
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
    /// Write manual pages, one a command
    Man {
        /// Folder for the pages; it is made where there is none
        #[arg(value_name = "FOLDER")]
        folder: std::path::PathBuf,
    },
}

impl Command {
    /// Whether the run tells what it does as lines of JSON.
    pub(crate) fn tells_json(&self) -> bool {
        let log = match self {
            Self::Segment(args) => args.output.log,
            Self::Distance(args) => args.job.output.log,
            Self::Middle(args) => args.job.output.log,
            Self::Reconstruct(args) => args.output.log,
            Self::Demo(args) => args.log,
            Self::Convert(args) => args.log,
            Self::Batch(args) => args.log,
            Self::Verify(args) => args.log,
            _ => return false,
        };
        log == LogArg::Json
    }
}

pub(crate) const HELP_ON_SEGMENT: &str = "\
Lengths are physical, in the unit of the image; triples are x,y,z; the centre of the first voxel is 0,0,0,
or where an OME-Zarr image has it.
Exit codes: 0 done, 1 the run failed, 2 wrong usage or unusable input, 3 some\nobjects could not be solved, 130 interrupted, 143 terminated.";

pub(crate) const HELP_ON_BATCH: &str = "\
Exit codes: 0 all items are done, 1 the run failed, 2 wrong usage or a list with mistakes, 3 some items failed,
130 interrupted, 143 terminated.";

pub(crate) const HELP_ON_VERIFY: &str = "\
Nothing of the store is changed.
Exit codes: 0 all is well, 1 something is wrong, 2 there is no such store or it cannot be run again, 130 interrupted, 143
terminated.";

pub(crate) const HELP_ON_DISTANCE: &str = "\
Lengths are those of the files; triples are x,y,z.
Exit codes: 0 done, 1 the run failed, 2 wrong usage or unusable input, 130 interrupted, 143 terminated.";
