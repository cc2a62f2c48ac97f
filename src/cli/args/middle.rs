//! What was typed after `middle`: labelled sources, grid, method, which surface. It runs as a distance with labels does.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::distance::{FieldJobArgs, sources_help};

/// Compute the surface equally far from labelled point clouds and triangle meshes, and smooth walls between labels of a volume that
/// touch.
#[derive(Clone, Debug, Args)]
pub(crate) struct MiddleArgs {
    #[arg(required = true, num_args = 1.., value_name = "SOURCE", help = labelled_help())]
    pub(crate) sources: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) job: FieldJobArgs,
    #[command(flatten)]
    pub(crate) surface: SurfaceArgs,
}

/// Which surface.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Surface")]
pub(crate) struct SurfaceArgs {
    /// Surface between labels: where both distances are equal, or the isosurface of the voxels' labels (two sources)
    #[arg(long, value_enum, default_value_t = SurfaceArg::Exact)]
    pub(crate) surface: SurfaceArg,
    /// Labels: those of the sources that the method tracks, or of the nearest sources without an exception. Of equal
    /// distances the lower label
    #[arg(long, value_enum, default_value_t = LabelsArg::Tracked)]
    pub(crate) labels: LabelsArg,
    /// Of one label volume: surfaces of labels against what has none (label 0) and against what lies around the volume too, so that
    /// each label has a closed surface around it
    #[arg(long)]
    pub(crate) background: bool,
    /// Write the surface once more, in a file of its own, in the format of its name
    #[arg(long, value_name = "FILE.ply|obj|stl|vtp")]
    pub(crate) mesh: Option<PathBuf>,
}

/// Which surface lies between labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum SurfaceArg {
    /// Where both distances are equal
    Exact,
    /// Half way between the voxels of one label and the other
    Labels,
}

/// How labels are told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum LabelsArg {
    /// By the sources that the method tracks
    Tracked,
    /// By the nearest sources
    Exact,
}

/// The line of the help that lists the formats.
fn labelled_help() -> String {
    format!("{}; the n-th has label n, the labels of a volume are its own", sources_help())
}
