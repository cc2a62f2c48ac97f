//! What was typed after `reconstruct`: the cloud, the grid, how the surface moves. What it means together is decided in
//! `reconstruct`.

use std::path::PathBuf;

use clap::Args;

use super::args::{DistanceArgs, MotionArgs, ResourceArgs};
use super::distance_args::FieldOutputArgs;
use super::values::{parse_spacing, parse_triple, parse_whole_triple};

/// Reconstruct a closed surface from a point cloud, without normals.
#[derive(Clone, Debug, Args)]
pub(super) struct ReconstructArgs {
    /// Points (CSV, XYZ, PLY), or a mesh whose vertices are taken
    pub(super) cloud: PathBuf,
    #[command(flatten)]
    pub(super) grid: CloudGridArgs,
    #[command(flatten)]
    pub(super) motion: MotionArgs,
    #[command(flatten)]
    pub(super) distance: DistanceArgs,
    #[command(flatten)]
    pub(super) resources: ResourceArgs,
    /// Ranks that share the cells, each a thread with files of its own; results do not depend on it
    #[arg(long, value_name = "N", default_value_t = 1, hide = true)]
    pub(super) ranks: usize,
    #[command(flatten)]
    pub(super) output: FieldOutputArgs,
    /// Write the surface once more, in a file of its own, in the format of its name
    #[arg(long, value_name = "FILE.ply|obj|stl|vtp", help_heading = "Output")]
    pub(super) mesh: Option<PathBuf>,
}

/// How fine the grid is, and where it lies.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Grid")]
pub(super) struct CloudGridArgs {
    /// Distance between voxel centres, one for all axes or three [default: half the spacing of the points]
    #[arg(long, value_name = "H|HX,HY,HZ", value_parser = parse_spacing, allow_hyphen_values = true)]
    pub(super) spacing: Option<[f64; 3]>,
    /// Write fields on the grid that has this room around the points, a length [default: as much as is solved]
    #[arg(long, value_name = "D", allow_hyphen_values = true, conflicts_with_all = ["origin", "shape"])]
    pub(super) padding: Option<f64>,
    /// Write fields on the grid that starts here, the centre of its first voxel; with --shape
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_triple, allow_hyphen_values = true, requires = "shape")]
    pub(super) origin: Option<[f64; 3]>,
    /// Voxels along each axis; with --origin and --spacing
    #[arg(long, value_name = "NX,NY,NZ", value_parser = parse_whole_triple, allow_hyphen_values = true,
          requires_all = ["origin", "spacing"])]
    pub(super) shape: Option<[i64; 3]>,
    /// Leave out points that have not three others within so many of the points' spacings [without a number: 4]
    #[arg(long, value_name = "N", num_args = 0..=1, require_equals = true, default_missing_value = "4", allow_hyphen_values = true)]
    pub(super) drop_isolated: Option<f64>,
}
