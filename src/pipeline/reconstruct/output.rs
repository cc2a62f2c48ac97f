//! The whole job: search what the cloud encloses, move the surface, draw, measure and write it.

use std::fmt;

use super::caps::{Cap, Closing, close};
use super::estimate::{BUFFERS, WRITING, begin, boxes};
use super::flat::flat;
use super::noise::{Noise, without_noise};
use super::on_grid::OnGrid;
use super::settings::ReconstructSettings;
use crate::error::{Error, Result};
use crate::exec::{Engine, Hold, Stage};
use crate::grid::{Box3, Geometry, digits};
use crate::io::ome_zarr::{Content, ImageSpec, StoreWriter};
use crate::kernel::surface::{Hausdorff, Measures, Spread};
use crate::pipeline::enclosure::search::{Deepest, Enclosure, Found, Hole, Search, Start, enclose, first_reach_for};
use crate::pipeline::enclosure::sheets::{Company, hold_sheets};
use crate::pipeline::level_set::band::Band;
use crate::pipeline::level_set::growing::Growing;
use crate::pipeline::level_set::ranks::evolve_on_ranks;
use crate::pipeline::level_set::time_loop::Evolution;
use crate::pipeline::output::pyramid::{Reduce, write_levels};
use crate::pipeline::surface::{self, Drawn};
use crate::pipeline::topology::{Removed, remove_small};
use crate::store::{BoxSource, BrickArray, ElementType, MeshSink};

/// Points farther from the solved surface than so many largest spacings have been left by it.
const LEFT_VOXELS: f64 = 0.6;

/// Where more of the points than this part have one side all around them, holes are looked for that let it in.
const MOST_SHEET: f64 = 0.02;

/// A point may be so many deviations of the noise off the surface.
const OF_NOISE: f64 = 3.0;

/// A cloud that is no thicker than this part of a spacing, root mean square, is flat.
const FLAT_VOXELS: f64 = 0.1;

/// What a reconstruction found.
pub struct Reconstruction {
    /// The grid that u is written on.
    pub geometry: Geometry,
    /// Where the start surface lay.
    pub beta: f64,
    /// How the points scatter around the surface, and how many of them were moved onto it for that.
    pub noise: Noise,
    /// The holes that were closed by caps, the widest first.
    pub caps: Vec<Cap>,
    /// The cloud's largest hole.
    pub hole: Option<Hole>,
    /// Number of spaces that the cloud encloses.
    pub spaces: usize,
    /// Points held as thin shells, or as slits inside a body, since the surface would close over them.
    pub sheet_points: u64,
    /// Handles and pieces that were taken away; none where they were to stay.
    pub removed: Option<Removed>,
    /// Number of voxels that were solved.
    pub band_voxels: u64,
    /// How the time loop ended.
    pub evolution: Evolution,
    /// The surface's measures.
    pub measures: Measures,
    /// Distances of the points from the surface.
    pub hausdorff: Option<Hausdorff>,
    /// How many points are how far from it.
    pub spread: Option<Spread>,
    /// Points farther from the surface than the largest spacing and three times the noise.
    pub lost_points: u64,
    /// The solved fields.
    band: Band,
    /// Where the box that they were solved on lies in the grid, where these are not the same.
    window: Option<Box3>,
    /// What they take of the memory as long as they are there.
    _held: [Hold; 2],
}

impl fmt::Debug for Reconstruction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { geometry, measures, hausdorff, .. } = self;
        let mut told = f.debug_struct("Reconstruction");
        told.field("geometry", geometry)
            .field("measures", measures)
            .field("hausdorff", hausdorff)
            .finish_non_exhaustive()
    }
}

impl Reconstruction {
    /// The segmentation function on the grid: 1 inside, 0 outside, the surface at 1/2.
    #[must_use]
    pub fn level_set(&self) -> impl BoxSource<f32> + Send {
        self.field(&self.band.u, 0.0)
    }

    /// The distance to the cloud on the grid, physical units, as far as the level set had to know it.
    #[must_use]
    pub fn distance(&self) -> impl BoxSource<f32> + Send {
        self.field(&self.band.distance, self.band.distance.absent(0))
    }

    fn field<'a>(&self, field: &'a BrickArray<f32>, beyond: f32) -> OnGrid<'a> {
        let window = self.window.unwrap_or(self.geometry.domain());
        OnGrid { field, window, shape: self.geometry.shape, beyond }
    }

    /// Writes the fields.
    ///
    /// # Errors
    /// When the memory is too little, the output cannot be written, scratch runs out, or the run is interrupted.
    pub fn write(&self, engine: &Engine, store: &StoreWriter) -> Result<()> {
        let _buffers = engine.hold(WRITING.bytes(engine.threads() as u64))?;
        let geometry = &self.geometry;
        let farthest = f64::from(self.band.distance.absent(0));
        let fields: [(&str, &str, &dyn BoxSource<f32>, f64); 2] =
            [("", "levelset", &self.level_set(), 1.0), ("distance", "distance", &self.distance(), farthest)];
        for (group, name, field, high) in fields {
            let spec = ImageSpec {
                name,
                geometry,
                element: ElementType::F32,
                content: Content::Field,
                window: Some([0.0, high]),
                extremes: None,
            };
            let stage = engine.resumable_stage(&format!("write {name}"), 0);
            stage.voxels(geometry.domain().volume());
            write_levels::<f32>(&stage, engine, store.image(group, &spec)?, field, Reduce::Mean)?;
            stage.finish();
        }
        Ok(())
    }
}

/// Reconstructs the surface of a cloud on a grid, on a box of it that grows as far around the cloud as is needed; `mesh` gets
/// the surface. Of several ranks, whose number changes no bit, each solves its part of the distance and of the level set and writes its part
/// of the fields; the first draws the surface.
///
/// # Errors
/// When the memory is too little, the cloud encloses nothing, the surface vanishes, the mesh is not taken, scratch runs out, or the run is
/// interrupted.
pub fn reconstruct(
    engine: &Engine,
    grid: &Geometry,
    cloud: &[[f64; 3]],
    settings: &ReconstructSettings,
    mesh: &mut dyn MeshSink,
) -> Result<Reconstruction> {
    reconstruct_shown(engine, grid, cloud, settings, (mesh, None))
}

/// The same; a store that is live shows the surface while it moves.
///
/// # Errors
/// As [`reconstruct`], and when what is shown cannot be written.
pub fn reconstruct_shown(
    engine: &Engine,
    grid: &Geometry,
    cloud: &[[f64; 3]],
    settings: &ReconstructSettings,
    (mesh, shown_in): (&mut dyn MeshSink, Option<&StoreWriter>),
) -> Result<Reconstruction> {
    let _buffers = engine.reserve(BUFFERS)?;
    let held = engine.reserve(boxes(&begin(grid, cloud, settings), cloud))?;
    let (smooth, noise) = without_noise(engine, cloud, settings.noise)?;
    // The surface is that of the smooth points; what is measured is how far it is from those that were given.
    let points = smooth.as_deref().unwrap_or(cloud);
    let Begun { enclosure, closed, caps } = enclosed(engine, grid, points, settings)?;
    let points = closed.as_deref().unwrap_or(points);
    let (geometry, hole, spaces) = (enclosure.geometry.clone(), enclosure.hole(), enclosure.spaces());
    let window = enclosure.window;
    let larger_beta = enclosure.larger_beta();
    let (beta, mut sheet) = (enclosure.beta, enclosure.sheet().to_vec());
    let (mut band, held_by_box) = enclosure.into_band(engine, "")?;
    let mut growing = Growing::of(shown_in, "surface", &geometry)?;
    let evolution = solve(engine, &geometry, points, settings, (&mut band, &mut sheet), growing.as_mut())?;
    drop(growing);
    let removed = (!settings.keeps_topology).then(|| remove_small(engine, &band.u, &geometry, cloud)).transpose()?;
    let told = if settings.keeps_grid { grid.clone() } else { geometry.clone() };
    mesh.on_grid(&told)?;
    let is_first = engine.comm().rank() == 0;
    let lost_beyond =
        geometry.max_spacing() + noise.deviation.filter(|_| noise.moved > 0).map_or(0.0, |d| OF_NOISE * d);
    let drawn = if is_first { draw(engine, (&band, &geometry), (cloud, lost_beyond), mesh)? } else { Drawn::default() };
    let Drawn { measures, hausdorff, spread, lost_points } = drawn;
    if is_first && (measures.triangles == 0 || lost_points == cloud.len() as u64) {
        return Err(vanished(settings, grid, larger_beta));
    }
    if settings.beta.is_some() && evolution.is_unrested() && 2 * lost_points > cloud.len() as u64 {
        return Err(on_its_way(evolution.steps, lost_points, cloud.len()));
    }
    Ok(Reconstruction {
        geometry: told,
        beta,
        noise,
        caps,
        hole,
        spaces,
        sheet_points: sheet.len() as u64,
        removed,
        band_voxels: band.voxels,
        evolution,
        measures,
        hausdorff,
        spread,
        lost_points,
        band,
        window: settings.keeps_grid.then_some(window),
        _held: [held, held_by_box],
    })
}

/// Draws and measures the surface.
fn draw(
    engine: &Engine,
    (band, geometry): (&Band, &Geometry),
    cloud: (&[[f64; 3]], f64),
    mesh: &mut dyn MeshSink,
) -> Result<Drawn> {
    let stage = engine.stage("surface", 0);
    stage.voxels(band.voxels);
    let drawn = surface::draw(&stage, &band.u, geometry, cloud, mesh)?;
    stage.finish();
    Ok(drawn)
}

/// What a search starts from, and what was found.
struct Begun {
    enclosure: Box<Enclosure>,
    /// The points that close the cloud, behind its own.
    closed: Option<Vec<[f64; 3]>>,
    caps: Vec<Cap>,
}

/// What the cloud encloses: as it is where that is told near it, else with caps over its holes, else as far from it as is needed.
fn enclosed(engine: &Engine, grid: &Geometry, cloud: &[[f64; 3]], settings: &ReconstructSettings) -> Result<Begun> {
    let search = Search {
        grid,
        cloud,
        method: settings.method,
        beta: settings.beta,
        start: Start::Watershed,
        first_reach: first_reach_for(grid, settings.beta),
        only_near: true,
        suffix: "",
    };
    let begun = |enclosure, closed, caps| Ok(Begun { enclosure, closed, caps });
    let mut found = enclose(engine, &search)?;
    let most = MOST_SHEET * cloud.len() as f64;
    let lost = match &found {
        Found::Open => Some(usize::MAX),
        Found::Enclosed(enclosure) => Some(enclosure.sheet().len()).filter(|&lost| lost as f64 > most),
        _ => None,
    };
    if let Some(lost) = lost.filter(|_| settings.beta.is_none()) {
        let Closing { points, caps } = close(&engine.by_itself(), cloud)?;
        if !points.is_empty() {
            let closed = [cloud, &points].concat();
            let search = Search { cloud: &closed, suffix: " with caps", ..search };
            if let Found::Enclosed(enclosure) = enclose(engine, &search)?
                && enclosure.sheet().len() < lost / 2
            {
                return begun(enclosure, Some(closed), caps);
            }
        }
    }
    if matches!(found, Found::Open) {
        found = enclose(engine, &Search { only_near: false, suffix: " farther", ..search })?;
    }
    match found {
        Found::Enclosed(enclosure) => begun(enclosure, None, Vec::new()),
        Found::Leaks(deepest) => Err(flat_cloud(grid, cloud).unwrap_or_else(|| leaks(settings, grid, &deepest))),
        Found::Nothing(deepest) => {
            let nothing = || encloses_nothing(settings, grid, deepest.as_ref());
            Err(flat_cloud(grid, cloud).unwrap_or_else(nothing))
        }
        Found::Open => Err(encloses_nothing(settings, grid, None)),
    }
}

/// Moves the surface until it rests, and again where it left points that it should not; `sheet` gets these.
fn solve(
    engine: &Engine,
    geometry: &Geometry,
    cloud: &[[f64; 3]],
    settings: &ReconstructSettings,
    (band, sheet): (&mut Band, &mut Vec<u32>),
    mut growing: Option<&mut Growing<'_>>,
) -> Result<Evolution> {
    let stage = engine.resumable_stage("level set", 0);
    stage.voxels(band.voxels);
    let time_loop = settings.motion.time_loop(geometry);
    let mut evolution = evolve_on_ranks(&stage, engine, band, geometry.spacing, &time_loop, growing.as_deref_mut())?;
    // Where more smoothing was asked for, the surface leaves points because it shall.
    let keeps_points = settings.beta.is_none() && settings.motion.smooths_no_more_than_usual(geometry);
    let late = if keeps_points { hold_what_was_lost(&stage, geometry, cloud, band)? } else { Vec::new() };
    if !late.is_empty() {
        sheet.extend(late);
        sheet.sort_unstable();
        sheet.dedup();
        let again = evolve_on_ranks(&stage, engine, band, geometry.spacing, &time_loop, growing)?;
        let (steps, sor_iterations) = (evolution.steps + again.steps, evolution.sor_iterations + again.sor_iterations);
        let residuals = [evolution.residuals, again.residuals.clone()].concat();
        evolution = Evolution { steps, sor_iterations, residuals, ..again };
    }
    stage.finish();
    Ok(evolution)
}

/// Holds what the surface has left; returns these points.
fn hold_what_was_lost(stage: &Stage<'_>, geometry: &Geometry, cloud: &[[f64; 3]], band: &Band) -> Result<Vec<u32>> {
    let off = surface::distances_to(stage, &band.u, geometry, cloud)?;
    let is_lost = |(_, off): &(u32, &Option<f64>)| off.is_some_and(|off| off > LEFT_VOXELS * geometry.max_spacing());
    let lost: Vec<u32> = (0..).zip(&off).filter(is_lost).map(|(point, _)| point).collect();
    Ok(hold_sheets(geometry, cloud, &lost, Company::AT_THE_END, band))
}

/// What is said of a cloud that no setting gives an inside.
fn flat_cloud(grid: &Geometry, cloud: &[[f64; 3]]) -> Option<Error> {
    let place = flat(cloud, FLAT_VOXELS * grid.min_spacing())?;
    Some(Error::input(format!(
        "the points enclose nothing: all of them lie {place}, which has no inside; give points of all sides of the body"
    )))
}

fn leaks(settings: &ReconstructSettings, grid: &Geometry, deepest: &Deepest) -> Error {
    let beta = settings.beta.unwrap_or_default();
    let larger = deepest.beta().map_or(String::new(), |beta| format!(", or give --beta {beta}"));
    Error::input(format!(
        "with --beta {beta} the start leaks through {}; leave --beta out{larger}",
        hole_of(&deepest.hole, grid)
    ))
}

fn hole_of(hole: &Hole, grid: &Geometry) -> String {
    let place = digits::place(hole.place, grid.min_spacing());
    format!("a hole {} wide at {place}", digits::number(hole.width))
}

fn encloses_nothing(settings: &ReconstructSettings, grid: &Geometry, deepest: Option<&Deepest>) -> Error {
    let spacing = digits::number(grid.min_spacing());
    let with = settings.beta.map_or(String::new(), |beta| format!(" with --beta {beta}"));
    let Some((deepest, beta)) = deepest.and_then(|deepest| Some((deepest, deepest.beta()?))) else {
        return Error::input(format!(
            "the points enclose nothing at the spacing {spacing}{with}: outside reaches everywhere; give points of all \
             sides of the body, or a finer --spacing if they lie denser than that"
        ));
    };
    let depth = digits::number(deepest.depth);
    let hole = hole_of(&deepest.hole, grid);
    Error::input(format!(
        "the points enclose nothing at the spacing {spacing}{with}: the deepest space is {depth} deep, which has {hole}, and \
         a space has to be deeper than its hole is wide; give --beta {beta} if the body is that thin, else points of all \
         sides of it, or a finer --spacing if they lie denser than that"
    ))
}

fn vanished(settings: &ReconstructSettings, grid: &Geometry, larger_beta: Option<f64>) -> Error {
    let spacing = digits::number(grid.min_spacing());
    let what = match (larger_beta, settings.beta) {
        (Some(larger), _) => format!("give a larger --beta, such as {larger}"),
        (None, Some(_)) => format!("leave --beta out, or give a --spacing finer than {spacing}"),
        (None, None) => format!("give a --spacing finer than {spacing}, or less smoothing (--delta)"),
    };
    Error::vanished(format!("the surface vanished: it shrank away from all points; {what}"))
}

fn on_its_way(steps: u32, lost: u64, points: usize) -> Error {
    Error::failed(format!(
        "after {steps} time steps the surface is still on its way: {} of {} points are farther than a voxel from it; give a smaller \
         --beta, or leave it out, or give more --max-steps",
        digits::grouped(lost),
        digits::grouped(points as u64)
    ))
}
