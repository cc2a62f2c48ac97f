//! The flags of `strandline measure`.

use std::path::PathBuf;

use clap::Args;

/// Measure a triangle mesh.
#[derive(Debug, Args)]
pub(crate) struct MeasureArgs {
    /// Triangle mesh: PLY, OFF, STL, OBJ
    pub(crate) mesh: PathBuf,
    /// Points whose distances from the mesh are measured; of a mesh its vertices
    #[arg(long, value_name = "CLOUD")]
    pub(crate) points: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub(crate) json: bool,
}
