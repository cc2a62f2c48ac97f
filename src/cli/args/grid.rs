//! What was typed of a grid: how fine it is, which box it fills, or whose it is.

use std::path::PathBuf;

use clap::Args;

use super::common::PointsIn;
use super::pages::VolumeArgs;
use super::values::{parse_spacing, parse_triple, parse_whole_triple};

/// Where the grid lies.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Grid")]
pub(crate) struct GridArgs {
    /// Distance between voxel centres, one for all axes or three [default: 1/256 of the longest side]
    #[arg(long, value_name = "H|HX,HY,HZ", value_parser = parse_spacing, allow_hyphen_values = true)]
    pub(crate) spacing: Option<[f64; 3]>,
    #[command(flatten)]
    pub(crate) filled: GridBoxArgs,
    /// The grid of this image: TIFF stack, folder of slices or OME-Zarr; that of a label volume is taken without being asked for
    #[arg(long, value_name = "IMAGE", conflicts_with_all = ["spacing", "padding", "origin", "shape"])]
    pub(crate) like: Option<PathBuf>,
    /// Distance between voxel centres of label volumes, of --like and of --speed, in place of what the file says
    #[arg(long, value_name = "H|HX,HY,HZ", value_parser = parse_spacing, allow_hyphen_values = true)]
    pub(crate) image_spacing: Option<[f64; 3]>,
    #[command(flatten)]
    pub(crate) volume: VolumeArgs,
    /// What the numbers of points are: voxel indices of the grid of --like (or of --origin, --shape and --spacing), the
    /// first one 0, or lengths [default: with --like as the file's form says: voxels of napari and of ROIs, else lengths]
    #[arg(long, value_enum)]
    pub(crate) points_in: Option<PointsIn>,
}

/// Which box a grid fills. The surface of `reconstruct` is that of all points all the same; its fields end with the box.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Grid")]
pub(crate) struct GridBoxArgs {
    /// Room around the sources, a length [default: 1/6 of their largest extent; reconstruct: as much as is solved]
    #[arg(long, value_name = "D", allow_hyphen_values = true, conflicts_with_all = ["origin", "shape"])]
    pub(crate) padding: Option<f64>,
    /// Centre of the first voxel; with --shape
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_triple, allow_hyphen_values = true, requires = "shape")]
    pub(crate) origin: Option<[f64; 3]>,
    /// Voxels along each axis; with --origin and --spacing
    #[arg(long, value_name = "NX,NY,NZ", value_parser = parse_whole_triple, allow_hyphen_values = true,
          requires_all = ["origin", "spacing"])]
    pub(crate) shape: Option<[i64; 3]>,
}

impl GridBoxArgs {
    /// Whether anything was said.
    pub(crate) fn is_given(&self) -> bool {
        self.padding.is_some() || self.origin.is_some()
    }
}
