//! What a reconstruction reports: its settings, and what was found.

use std::path::Path;

use serde::Serialize;

use super::run_report::{Distances, Hausdorff, Hole, SimplifiedCopy};
use super::settings::{Moved, Moves};
use crate::cli::args::reconstruct::ReconstructArgs;
use crate::pipeline::output::viewer_mesh::Simplified;
use crate::pipeline::reconstruct::{Cap, ReconstructSettings, Reconstruction};
use crate::pipeline::topology::Removed;

/// Every setting, also those that nobody gave; lengths physical.
#[derive(Debug, Serialize)]
pub(crate) struct Settings {
    cloud: String,
    output: Option<String>,
    compress: &'static str,
    ome: &'static str,
    method: &'static str,
    #[serde(flatten)]
    motion: Moves,
    /// Null when it was found; it is then in the result.
    beta: Option<f64>,
    /// Null when it was told from the points; it is then in the result.
    noise: Option<f64>,
    /// Whether the surface was to end where the points do.
    open: bool,
    /// Where the mesh has its vertices.
    vertices: &'static str,
    keep_topology: bool,
    scratch: String,
}

impl Settings {
    pub(crate) fn new(
        args: &ReconstructArgs,
        settings: &ReconstructSettings,
        scratch: &Path,
        found: &Reconstruction,
    ) -> Self {
        Self {
            cloud: args.cloud.display().to_string(),
            output: args.output.store().map(|path| path.display().to_string()),
            compress: args.output.compress.name(),
            ome: args.output.ome.name(),
            method: settings.method.name(),
            motion: Moves::new(&settings.motion, &found.geometry),
            beta: settings.beta,
            noise: settings.noise,
            open: settings.open,
            vertices: settings.vertices_on(&found.geometry).name(),
            keep_topology: settings.keeps_topology,
            scratch: scratch.display().to_string(),
        }
    }
}

/// What was found.
#[derive(Debug, Serialize)]
pub(crate) struct Found {
    /// Null where the surface is open.
    volume: Option<f64>,
    area: f64,
    closed: bool,
    components: u64,
    triangles: u64,
    /// The copy of a large surface.
    simplified: Option<SimplifiedCopy>,
    open_edges: u64,
    /// The length of these edges.
    rim: f64,
    /// The area that was cut off because no points support it; null without `--open`.
    trimmed_area: Option<f64>,
    hausdorff: Option<Hausdorff>,
    distances: Option<Distances>,
    cloud_points: u64,
    /// Points farther from the surface than a voxel, and than three times a noise that was followed.
    lost_points: u64,
    /// Points held as thin shells or slits.
    sheet_points: u64,
    spaces: usize,
    beta: f64,
    /// Standard deviation of the points from the surface; null where they do not tell it.
    noise: Option<f64>,
    /// Points that were moved onto the surface around them.
    moved_points: u64,
    /// How far vertices of the mesh lie, at most, from where the level set has them.
    moved_vertices: f64,
    hole: Option<Hole>,
    /// Holes that were closed though no points are there, the widest first.
    caps: Vec<CappedHole>,
    /// Handles and pieces that were taken away; null where they were to stay.
    removed: Option<RemovedParts>,
    band_voxels: u64,
    #[serde(flatten)]
    moved: Moved,
}

impl Found {
    pub(crate) fn new(found: &Reconstruction, cloud_points: u64, copy: Option<Simplified>) -> Self {
        Self {
            volume: found.measures.is_closed().then_some(found.measures.volume),
            area: found.measures.area,
            closed: found.measures.is_closed(),
            components: found.measures.components,
            triangles: found.measures.triangles,
            simplified: copy.map(Into::into),
            open_edges: found.measures.open_edges,
            rim: found.measures.rim,
            trimmed_area: found.trimmed,
            hausdorff: found.hausdorff.map(Into::into),
            distances: found.spread.clone().map(Into::into),
            cloud_points,
            lost_points: found.lost_points,
            sheet_points: found.sheet_points,
            spaces: found.spaces,
            beta: found.beta,
            noise: found.noise.deviation,
            moved_points: found.noise.moved,
            moved_vertices: found.moved_vertices,
            hole: found.hole.map(Into::into),
            caps: found.caps.iter().map(|cap| CappedHole::new(cap, found.measures.area)).collect(),
            removed: found.removed.map(Into::into),
            band_voxels: found.band_voxels,
            moved: Moved::from(&found.evolution),
        }
    }
}

/// A hole that was closed.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct CappedHole {
    width: f64,
    place_xyz: [f64; 3],
    area: f64,
    /// Its part of the surface.
    share: f64,
}

impl CappedHole {
    fn new(cap: &Cap, surface: f64) -> Self {
        Self { width: cap.width, place_xyz: cap.place, area: cap.area, share: cap.area / surface }
    }
}

/// What was taken away of the surface, being no more than a few spacings wide.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct RemovedParts {
    /// Handles that were cut.
    handles: u64,
    /// Tunnels that were filled.
    tunnels: u64,
    /// The widest of the cuts and fillings, a length.
    widest: f64,
    /// Pieces and hollows that were dropped.
    crumbs: u64,
}

impl From<Removed> for RemovedParts {
    fn from(Removed { handles, tunnels, widest, crumbs }: Removed) -> Self {
        Self { handles, tunnels, widest, crumbs }
    }
}
