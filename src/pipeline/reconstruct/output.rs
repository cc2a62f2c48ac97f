//! The whole job: search what the cloud encloses, move the surface, draw, measure and write it.

use std::fmt;

use super::begun::{Begun, enclosed};
use super::caps::Cap;
use super::estimate::{BUFFERS, WRITING, begin, boxes};
use super::fitted::{BYTES, Fitted};
use super::noise::{Noise, without_noise};
use super::normals::sided::Sided;
use super::on_grid::OnGrid;
use super::settings::{ReconstructSettings, Vertices};
use crate::error::{Error, Result};
use crate::exec::{Engine, Hold, SelfComm, Stage};
use crate::grid::{Box3, Geometry, digits};
use crate::io::ome_zarr::{Content, ImageSpec, StoreWriter};
use crate::kernel::surface::{Hausdorff, Measures, Patch, Spread};
use crate::pipeline::enclosure::search::Hole;
use crate::pipeline::enclosure::sheets::{Company, hold_sheets};
use crate::pipeline::level_set::band::Band;
use crate::pipeline::level_set::growing::Growing;
use crate::pipeline::level_set::ranks::evolve_on_ranks;
use crate::pipeline::level_set::time_loop::Evolution;
use crate::pipeline::output::pyramid::{Reduce, write_levels};
use crate::pipeline::surface::{self, Drawn, Isosurface, Placement};
use crate::pipeline::topology::{Removed, remove_small};
use crate::store::{BoxSource, BrickArray, ElementType, MeshSink};

/// Points farther from the solved surface than so many largest spacings have been left by it.
const LEFT_VOXELS: f64 = 0.6;

/// A point may be so many deviations of the noise off the surface.
const OF_NOISE: f64 = 3.0;

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
    /// The area that was cut off because no points support it; none where that was not asked for.
    pub trimmed: Option<f64>,
    /// The surface's measures.
    pub measures: Measures,
    /// Distances of the points from the surface.
    pub hausdorff: Option<Hausdorff>,
    /// How many points are how far from it.
    pub spread: Option<Spread>,
    /// How far vertices of the mesh lie, at most, from where the level set has them.
    pub moved_vertices: f64,
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
    let sided = if settings.open { Some(Sided::new(&engine.by_itself(), points)?) } else { None };
    let Begun { enclosure, closed, caps } = enclosed(engine, grid, points, settings, sided.as_ref())?;
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
    let fitted_to = Some(points).filter(|_| settings.vertices_on(&geometry) == Vertices::Points);
    let drawn = if is_first {
        draw(engine, (&band, &geometry), fitted_to, (cloud, lost_beyond), (mesh, sided.as_ref()))?
    } else {
        Drawn::default()
    };
    let Drawn { measures, moved, trimmed, hausdorff, spread, lost_points } = drawn;
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
        trimmed: settings.open.then_some(trimmed),
        measures,
        hausdorff,
        spread,
        moved_vertices: moved,
        lost_points,
        band,
        window: settings.keeps_grid.then_some(window),
        _held: [held, held_by_box],
    })
}

/// Draws the surface, its vertices where `points` have it if there are any, and measures it.
fn draw(
    engine: &Engine,
    (band, geometry): (&Band, &Geometry),
    points: Option<&[[f64; 3]]>,
    cloud: (&[[f64; 3]], f64),
    (mesh, sided): (&mut dyn MeshSink, Option<&Sided>),
) -> Result<Drawn> {
    let _held = engine.hold(points.map_or(0, |points| points.len() as u64 * BYTES))?;
    let stage = engine.stage("surface", 0);
    stage.voxels(band.voxels);
    let fitted = points.map(|points| Fitted::to(&stage, &band.u, geometry, points)).transpose()?;
    let placement = fitted.as_ref().map(|fitted| fitted as &dyn Placement);
    let surface = Isosurface { placement, ..Isosurface::of(&band.u, geometry) };
    let trimming = sided.map(|sided| sided.trimming(geometry));
    let trim = |patch: &mut Patch| trimming.as_ref().map_or(0.0, |trimming| trimming.trim(patch));
    let drawn = surface::draw_trimmed(&stage, &surface, cloud, mesh, &trim)?;
    stage.finish();
    Ok(drawn)
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
    if band.voxels == 0 {
        let stopped_by = "no-steps".into();
        return Ok(Evolution { steps: 0, sor_iterations: 0, stopped_by, residual: 0.0, residuals: Vec::new() });
    }
    let stage = engine.resumable_stage("level set", 0);
    stage.voxels(band.voxels);
    let time_loop = settings.motion.time_loop(geometry);
    let mut evolution =
        evolve_on_ranks(&stage, engine, band, None, geometry.spacing, &time_loop, growing.as_deref_mut())?;
    // Where more smoothing was asked for, the surface leaves points because it shall.
    let keeps_points = settings.beta.is_none() && settings.motion.smooths_no_more_than_usual(geometry);
    let late = if keeps_points { hold_what_was_lost(&stage, geometry, cloud, band)? } else { Vec::new() };
    if !late.is_empty() {
        sheet.extend(late);
        sheet.sort_unstable();
        sheet.dedup();
        let again = evolve_on_ranks(&stage, engine, band, None, geometry.spacing, &time_loop, growing)?;
        let (steps, sor_iterations) = (evolution.steps + again.steps, evolution.sor_iterations + again.sor_iterations);
        let residuals = [evolution.residuals, again.residuals.clone()].concat();
        evolution = Evolution { steps, sor_iterations, residuals, ..again };
    }
    stage.finish();
    Ok(evolution)
}

/// Holds what the surface has left; returns these points.
fn hold_what_was_lost(stage: &Stage<'_>, geometry: &Geometry, cloud: &[[f64; 3]], band: &Band) -> Result<Vec<u32>> {
    let off = surface::distances_to(stage, &Isosurface::of(&band.u, geometry), cloud)?;
    let is_lost = |(_, off): &(u32, &Option<f64>)| off.is_some_and(|off| off > LEFT_VOXELS * geometry.max_spacing());
    let lost: Vec<u32> = (0..).zip(&off).filter(is_lost).map(|(point, _)| point).collect();
    hold_sheets(&SelfComm, geometry, cloud, &lost, Company::AT_THE_END, band)
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
