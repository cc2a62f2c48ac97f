//! `report.json`: what was done, with which settings, at what cost, and what was found; all that repeating it needs.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use serde::Serialize;

use super::neighbours::{Contact, Neighbours};
use super::ranks::RankReport;
use super::settings::Moved;
use crate::cli::inputs::over_time::Origin;
use crate::cli::terminal::console::Console;
use crate::error::{Error, Result};
use crate::exec::{Engine, StageReport, peak_resident};
use crate::grid::Geometry;
use crate::job::resources::Resources;
use crate::pipeline::output::viewer_mesh::Simplified;
use crate::pipeline::segment::{ObjectReport, Outcome};

/// The whole report.
#[derive(Debug, Serialize)]
pub(crate) struct Report<S, R> {
    pub(crate) version: &'static str,
    pub(crate) command: &'static str,
    /// The command line as typed.
    pub(crate) arguments: Vec<String>,
    /// What had an effect, by name, inputs with their sums; empty of a run that was not to survive its end.
    pub(crate) fingerprint: BTreeMap<String, String>,
    pub(crate) settings: S,
    pub(crate) grid: Grid,
    pub(crate) threads: usize,
    pub(crate) ranks: usize,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) rank_reports: Vec<RankReport>,
    pub(crate) memory_budget_bytes: u64,
    pub(crate) peak_rss_bytes: u64,
    pub(crate) seconds: f64,
    pub(crate) notes: Vec<String>,
    pub(crate) stages: Vec<Stage>,
    pub(crate) result: R,
}

#[derive(Debug, Serialize)]
pub(crate) struct Grid {
    shape_zyx: [i64; 3],
    spacing_zyx: [f64; 3],
    origin_zyx: [f64; 3],
    unit: Option<String>,
}

#[derive(Debug, Serialize)]
pub(crate) struct Stage {
    name: String,
    seconds: f64,
    voxels: u64,
    brick_loads: u64,
    bricks: u64,
    bytes_read: u64,
    bytes_written: u64,
    iterations: u64,
    residual: f64,
    peak_rss_bytes: u64,
}

/// What was found; of one object everything directly, of all objects in the list.
#[derive(Debug, Serialize)]
pub(crate) struct Found {
    #[serde(flatten)]
    single: Option<Object>,
    label_voxels: BTreeMap<String, u64>,
    objects: Vec<Object>,
    refused: Vec<Refused>,
    neighbours: Neighbours,
    contacts: Vec<Contact>,
}

#[derive(Clone, Debug, Serialize)]
struct Object {
    label: u32,
    voxels: u64,
    volume: f64,
    area: f64,
    centroid_xyz: [f64; 3],
    closed: bool,
    components: u64,
    triangles: u64,
    /// The copy of a large surface.
    simplified: Option<SimplifiedCopy>,
    hausdorff: Option<Hausdorff>,
    distances: Option<Distances>,
    cloud_points: u64,
    beta: f64,
    hole: Option<Hole>,
    band_voxels: u64,
    #[serde(flatten)]
    moved: Moved,
    /// What was taken from the image, and how much marks and image weighed.
    image_model: String,
    theta: f64,
    rho: f64,
    /// Marks farther than a voxel from the surface.
    marks_off: u64,
    cross_validation: Option<CrossValidation>,
    /// Where its marks are from, of a series.
    #[serde(flatten)]
    origin: Option<Origin>,
}

/// What leaving out each outline tells; the slice is that across its axis, counted from 0.
#[derive(Clone, Debug, Serialize)]
struct CrossValidation {
    mean: f64,
    p90: f64,
    next_slice: Option<NextSlice>,
}

#[derive(Clone, Copy, Debug, Serialize)]
struct NextSlice {
    axis: &'static str,
    slice: i64,
}

impl From<crate::pipeline::segment::CrossValidation> for CrossValidation {
    fn from(found: crate::pipeline::segment::CrossValidation) -> Self {
        let next = found.next_slice.map(|(axis, slice)| NextSlice { axis: ["x", "y", "z"][axis], slice });
        Self { mean: found.mean, p90: found.p90, next_slice: next }
    }
}

/// An object that could not be solved.
#[derive(Debug, Serialize)]
struct Refused {
    label: u32,
    reason: String,
    /// Where its marks are from, of a series.
    #[serde(flatten)]
    origin: Option<Origin>,
}

/// Distances of the marks from the surface.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Hausdorff {
    mean: f64,
    max: f64,
}

impl From<crate::kernel::surface::Hausdorff> for Hausdorff {
    fn from(found: crate::kernel::surface::Hausdorff) -> Self {
        Self { mean: found.mean, max: found.max }
    }
}

/// How many marks are how far from the surface, in bins of one width that start at 0.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Distances {
    bin_width: f64,
    counts: Vec<u64>,
}

impl From<crate::kernel::surface::Spread> for Distances {
    fn from(found: crate::kernel::surface::Spread) -> Self {
        Self { bin_width: found.width, counts: found.counts }
    }
}

/// The copy of a large surface, with fewer triangles. Lengths physical.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct SimplifiedCopy {
    triangles: u64,
    /// Edge of the cubes whose vertices were joined.
    cube: f64,
    /// The largest distance from the copy, of the places where it was measured.
    error: f64,
    /// A vertex of what stays moved by no more than this.
    bound: f64,
    /// Share of the surface in pieces smaller than a cube, which the copy does not have.
    left_out: f64,
}

impl From<Simplified> for SimplifiedCopy {
    fn from(Simplified { triangles, cube, error, bound, left_out }: Simplified) -> Self {
        Self { triangles, cube, error, bound, left_out }
    }
}

/// The cloud's largest hole.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Hole {
    width: f64,
    place_xyz: [f64; 3],
}

impl From<crate::pipeline::enclosure::search::Hole> for Hole {
    fn from(hole: crate::pipeline::enclosure::search::Hole) -> Self {
        Self { width: hole.width, place_xyz: hole.place }
    }
}

fn zyx<T: Copy>([x, y, z]: [T; 3]) -> [T; 3] {
    [z, y, x]
}

impl Grid {
    fn new(geometry: &Geometry) -> Self {
        Self {
            shape_zyx: zyx(geometry.shape),
            spacing_zyx: zyx(geometry.spacing),
            origin_zyx: zyx(geometry.origin),
            unit: geometry.unit.clone(),
        }
    }
}

impl From<StageReport> for Stage {
    fn from(stage: StageReport) -> Self {
        Self {
            name: stage.name,
            seconds: stage.seconds,
            voxels: stage.voxels,
            brick_loads: stage.brick_loads,
            bricks: stage.bricks,
            bytes_read: stage.bytes_read,
            bytes_written: stage.bytes_written,
            iterations: stage.iterations,
            residual: stage.residual,
            peak_rss_bytes: stage.peak_rss_bytes,
        }
    }
}

impl Object {
    fn new(object: &ObjectReport, voxels: u64, origin: Option<Origin>) -> Self {
        Self {
            label: object.label,
            voxels,
            volume: object.measures.volume,
            area: object.measures.area,
            centroid_xyz: object.measures.centroid,
            closed: object.measures.is_closed(),
            components: object.measures.components,
            triangles: object.measures.triangles,
            simplified: object.simplified.map(Into::into),
            hausdorff: object.hausdorff.map(Into::into),
            distances: object.spread.clone().map(Into::into),
            cloud_points: object.cloud_points,
            beta: object.beta,
            hole: object.hole.map(Into::into),
            band_voxels: object.band_voxels,
            moved: Moved::from(&object.evolution),
            image_model: object.image_model.to_string(),
            theta: object.theta,
            rho: object.rho,
            marks_off: object.marks_off,
            cross_validation: object.cross_validation.map(Into::into),
            origin,
        }
    }
}

impl Found {
    /// Of a series, with the origin of the marks of each object.
    pub(crate) fn new(outcome: &Outcome, origins: &BTreeMap<u32, Origin>) -> Self {
        let voxels = |label| outcome.label_voxels.get(&label).copied().unwrap_or(0);
        let objects: Vec<Object> =
            outcome.objects.iter().map(|o| Object::new(o, voxels(o.label), origins.get(&o.label).copied())).collect();
        let single = if let [only] = objects.as_slice() { Some(only.clone()) } else { None };
        let label_voxels = outcome.objects.iter().map(|o| (o.label.to_string(), voxels(o.label))).collect();
        let contacts = outcome.contacts.iter().map(Contact::new).collect();
        let refused = outcome.refused.iter().map(|r| {
            let origin = origins.get(&r.label).copied();
            Refused { label: r.label, reason: r.reason.clone(), origin }
        });
        let refused = refused.collect();
        Self { single, label_voxels, objects, refused, neighbours: Neighbours::new(&outcome.neighbours), contacts }
    }
}

/// The crop as the report states it.
pub(crate) fn crop_xyz(part: &crate::grid::Box3) -> [[i64; 2]; 3] {
    std::array::from_fn(|a| [part.lo[a], part.hi[a]])
}

/// What a report tells of a run, whatever it was for.
pub(crate) struct Ran<'a> {
    pub(crate) command: &'static str,
    pub(crate) typed: &'a [String],
    pub(crate) resources: &'a Resources,
    pub(crate) console: &'a Console,
    pub(crate) engine: &'a Engine,
    pub(crate) ranks: usize,
    /// What each of several ranks did.
    pub(crate) rank_reports: &'a [RankReport],
    pub(crate) started: Instant,
}

impl<S: Serialize, R: Serialize> Report<S, R> {
    pub(crate) fn new(ran: &Ran<'_>, settings: S, geometry: &Geometry, result: R) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION"),
            command: ran.command,
            arguments: ran.typed.to_vec(),
            fingerprint: ran.engine.identity().into_iter().flatten().cloned().collect(),
            settings,
            grid: Grid::new(geometry),
            threads: ran.engine.threads(),
            ranks: ran.ranks,
            rank_reports: ran.rank_reports.to_vec(),
            memory_budget_bytes: ran.resources.memory,
            peak_rss_bytes: peak_resident(),
            seconds: ran.started.elapsed().as_secs_f64(),
            notes: ran.console.notes(),
            stages: ran.engine.reports().into_iter().map(Into::into).collect(),
            result,
        }
    }

    /// Writes the report; nothing stands under the name before it is whole. What did is replaced if that may be.
    pub(crate) fn write(&self, path: &Path, replace: bool) -> Result<()> {
        let fault = |error: std::io::Error| Error::from_io("the report cannot be written", &error).at(path);
        let mut text = serde_json::to_string_pretty(self).map_err(|error| fault(error.into()))?;
        text.push('\n');
        crate::cli::outputs::files::write_whole(path, replace, |file| std::io::Write::write_all(file, text.as_bytes()))
            .map_err(fault)
    }
}
