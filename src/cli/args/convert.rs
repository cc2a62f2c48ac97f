//! What was typed after `convert`.

use std::path::PathBuf;

use clap::Args;

use super::common::LogArg;
use super::pages::VolumeArgs;
use super::values::{CompressArg, OmeArg};
use super::values::{parse_size, parse_spacing};

/// Write a volume or a mesh in another format.
#[derive(Clone, Debug, Args)]
pub(crate) struct ConvertArgs {
    /// Volume (TIFF stack, folder of slices, OME-Zarr, NRRD, VTI) or an image in a store, such as OUT.zarr/distance or
    /// OUT.zarr/labels/segmentation; or a triangle mesh (PLY, OFF, STL, OBJ)
    #[arg(value_name = "IN")]
    pub(crate) input: PathBuf,
    /// File or store to write, in the format of its name: volumes .zarr (OME-Zarr), .tif (OME-TIFF), .vti, .nrrd; meshes
    /// .ply, .obj, .stl, .vtp
    #[arg(value_name = "OUT")]
    pub(crate) output: PathBuf,
    /// Replace an output that is there already
    #[arg(long)]
    pub(crate) overwrite: bool,
    /// Version of OME-Zarr: 0.5 (Zarr 3, chunks together in shards), or 0.4 (Zarr 2, a file for each chunk) [default: 0.5]
    #[arg(long, value_enum)]
    pub(crate) ome: Option<OmeArg>,
    /// How voxels are packed in OME-Zarr, TIFF and NRRD: fast, small, or not at all [default: fast]
    #[arg(long, value_enum)]
    pub(crate) compress: Option<CompressArg>,
    /// Voxels are numbers of objects, of which coarser levels have the most frequent one and no means [default: as OME-Zarr
    /// says]
    #[arg(long)]
    pub(crate) labels: bool,
    /// Distance between voxel centres, one for all axes or three [default: the file's]
    #[arg(long, value_name = "H|HX,HY,HZ", value_parser = parse_spacing, allow_hyphen_values = true)]
    pub(crate) image_spacing: Option<[f64; 3]>,
    #[command(flatten)]
    pub(crate) volume: VolumeArgs,
    /// Memory limit: bytes, or with KiB, MiB, GiB, TiB (K, M, G, T mean the same) or kB, MB, GB, TB
    /// [default: half of what the machine or the control group has]
    #[arg(long, value_name = "SIZE", value_parser = parse_size, help_heading = "Resources")]
    pub(crate) memory: Option<u64>,
    /// Threads [default: one for each core]
    #[arg(long, value_name = "N", help_heading = "Resources")]
    pub(crate) threads: Option<usize>,
    /// Folder for temporary fields, removed at the end [default: $TMPDIR, else the folder of the output]
    #[arg(long, value_name = "DIR", help_heading = "Resources")]
    pub(crate) scratch: Option<PathBuf>,
    /// Print nothing but errors
    #[arg(short, long)]
    pub(crate) quiet: bool,
    /// How the run tells what it does: lines to read, or one JSON object an event
    #[arg(long, value_enum, default_value_t = LogArg::Text)]
    pub(crate) log: LogArg,
}
