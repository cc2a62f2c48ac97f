//! What was typed after `reconstruct`: the cloud, the grid, how the surface moves. What it means together is decided in
//! `reconstruct`.

use std::path::PathBuf;

use clap::Args;

use super::common::{DistanceArgs, MotionArgs, OutputArgs, ResourceArgs};
use super::grid::GridBoxArgs;
use super::values::{VerticesArg, parse_spacing};

/// Reconstruct a closed surface from a point cloud, without normals; with --open one that ends with the points.
#[derive(Clone, Debug, Args)]
pub(crate) struct ReconstructArgs {
    /// Points (CSV, XYZ, PLY), or a mesh whose vertices are taken
    pub(crate) cloud: PathBuf,
    #[command(flatten)]
    pub(crate) grid: CloudGridArgs,
    #[command(flatten)]
    pub(crate) points: PointArgs,
    #[command(flatten)]
    pub(crate) surface: SurfaceArgs,
    #[command(flatten)]
    pub(crate) motion: MotionArgs,
    #[command(flatten)]
    pub(crate) distance: DistanceArgs,
    #[command(flatten)]
    pub(crate) resources: ResourceArgs,
    /// Ranks that share the cells, each a thread with files of its own; results do not depend on it
    #[arg(long, value_name = "N", default_value_t = 1, hide = true)]
    pub(crate) ranks: usize,
    #[command(flatten)]
    pub(crate) output: OutputArgs,
    /// Write the surface once more, in a file of its own, in the format of its name
    #[arg(long, value_name = "FILE.ply|obj|stl|vtp", help_heading = "Output")]
    pub(crate) mesh: Option<PathBuf>,
}

/// What the points are taken for.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Points")]
pub(crate) struct PointArgs {
    /// Standard deviation of the points from the surface, a length; 0 takes every point as it is [default: told from the points]
    #[arg(long, value_name = "D", allow_hyphen_values = true)]
    pub(crate) noise: Option<f64>,
    /// Let the surface end where the points do, with a rim: for a scan from one side, or a sheet [default: close it]
    #[arg(long)]
    pub(crate) open: bool,
}

/// How the surface is drawn.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Surface")]
pub(crate) struct SurfaceArgs {
    /// Where the mesh has its vertices: where the points have the surface, or where the level set crosses 1/2 [default: points, but with a
    /// smaller --theta or a larger --delta level-set]
    #[arg(long, value_name = "WHERE", value_enum)]
    pub(crate) vertices: Option<VerticesArg>,
    /// Leave handles, tunnels and pieces of a few spacings of the points, which no points speak for, as they are
    #[arg(long)]
    pub(crate) keep_topology: bool,
}

/// How fine the grid is, and on which box of it fields are written.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Grid")]
pub(crate) struct CloudGridArgs {
    /// Distance between voxel centres, one for all axes or three [default: half the spacing of the points]
    #[arg(long, value_name = "H|HX,HY,HZ", value_parser = parse_spacing, allow_hyphen_values = true)]
    pub(crate) spacing: Option<[f64; 3]>,
    #[command(flatten)]
    pub(crate) filled: GridBoxArgs,
    /// Leave out points that have not three others within so many of the points' spacings [without a number: 4]
    #[arg(long, value_name = "N", num_args = 0..=1, require_equals = true, default_missing_value = "4", allow_hyphen_values = true)]
    pub(crate) drop_isolated: Option<f64>,
}
