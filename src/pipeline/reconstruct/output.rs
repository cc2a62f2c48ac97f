//! The whole job: search what the cloud encloses, move the surface, draw, measure and write it.

use super::on_grid::OnGrid;
use super::settings::ReconstructSettings;
use crate::error::{Error, Result};
use crate::exec::{Engine, Stage};
use crate::grid::{Box3, Geometry};
use crate::io::ome_zarr::{ImageSpec, StoreWriter};
use crate::kernel::surface::{Hausdorff, Measures};
use crate::pipeline::band::Band;
use crate::pipeline::enclosure::{Found, Hole, Search, Start, enclose, first_reach_for};
use crate::pipeline::evolve::Evolution;
use crate::pipeline::evolve_ranks::evolve_on_ranks;
use crate::pipeline::pyramid::{Reduce, write_levels};
use crate::pipeline::sheets::{Company, hold_sheets};
use crate::pipeline::surface::{self, Drawn};
use crate::store::{BoxSource, ElementType};

/// Points farther from the solved surface than so many largest spacings have been left by it.
const LEFT_VOXELS: f64 = 0.6;

/// What a reconstruction found.
#[derive(Clone, Debug)]
pub struct Reconstruction {
    /// The grid that u is written on.
    pub geometry: Geometry,
    /// Where the start surface lay.
    pub beta: f64,
    /// The cloud's largest hole.
    pub hole: Option<Hole>,
    /// Number of spaces that the cloud encloses.
    pub spaces: usize,
    /// Points held as thin shells, or as slits inside a body, since the surface would close over them.
    pub sheet_points: u64,
    /// Number of voxels that were solved.
    pub band_voxels: u64,
    /// How the time loop ended.
    pub evolution: Evolution,
    /// The surface's measures.
    pub measures: Measures,
    /// Distances of the points from the surface.
    pub hausdorff: Option<Hausdorff>,
    /// Points farther from the surface than the largest spacing.
    pub lost_points: u64,
}

/// Reconstructs the surface of a cloud on a grid, on a box of it that grows as far around the cloud as is needed; `store`
/// gets the results, none of them when it is absent. Distance and level set are solved by all ranks of the engine, whose
/// number changes no bit.
///
/// # Errors
/// When the cloud encloses nothing, the output cannot be written, scratch runs out, or the run is interrupted.
pub fn reconstruct(
    engine: &Engine,
    grid: &Geometry,
    cloud: &[[f64; 3]],
    settings: &ReconstructSettings,
    store: Option<&StoreWriter>,
) -> Result<Reconstruction> {
    let search = Search {
        grid,
        cloud,
        method: settings.method,
        beta: settings.beta,
        start: Start::Watershed,
        first_reach: first_reach_for(grid, settings.beta),
        suffix: "",
    };
    let enclosure = match enclose(engine, &search)? {
        Found::Enclosed(enclosure) => enclosure,
        Found::Leaks(saddle) => return Err(leaks(settings, saddle)),
        Found::Nothing => return Err(encloses_nothing(grid)),
    };
    let (geometry, hole, spaces) = (enclosure.geometry.clone(), enclosure.hole(), enclosure.spaces());
    let window = enclosure.window;
    let (beta, mut sheet) = (enclosure.beta, enclosure.sheet().to_vec());
    let mut band = enclosure.into_band(engine, "")?;
    let stage = engine.stage("level set", 0);
    stage.voxels(band.voxels);
    let time_loop = settings.motion.time_loop(&geometry);
    let mut evolution = evolve_on_ranks(&stage, engine, &mut band, geometry.spacing, &time_loop)?;
    // Where more smoothing was asked for, the surface leaves points because it shall.
    let keeps_points = settings.beta.is_none() && settings.motion.smooths_no_more_than_usual(&geometry);
    let late = if keeps_points { hold_what_was_lost(&stage, &geometry, cloud, &band)? } else { Vec::new() };
    if !late.is_empty() {
        sheet.extend(late);
        sheet.sort_unstable();
        sheet.dedup();
        let again = evolve_on_ranks(&stage, engine, &mut band, geometry.spacing, &time_loop)?;
        let (steps, sor_iterations) = (evolution.steps + again.steps, evolution.sor_iterations + again.sor_iterations);
        evolution = Evolution { steps, sor_iterations, ..again };
    }
    stage.finish();
    let stage = engine.stage("surface", 0);
    stage.voxels(band.voxels);
    let mesh = store.map(|store| store.file("meshes/surface.ply")).transpose()?;
    let Drawn { measures, hausdorff, lost_points } = surface::draw(&stage, &band.u, &geometry, cloud, mesh.as_deref())?;
    stage.finish();
    let written = if settings.keeps_grid { grid.clone() } else { geometry };
    if let Some(store) = store {
        let window = settings.keeps_grid.then_some(window);
        write_fields(engine, &written, window, &band, store)?;
    }
    Ok(Reconstruction {
        geometry: written,
        beta,
        hole,
        spaces,
        sheet_points: sheet.len() as u64,
        band_voxels: band.voxels,
        evolution,
        measures,
        hausdorff,
        lost_points,
    })
}

/// Holds what the surface has left; returns these points.
fn hold_what_was_lost(stage: &Stage<'_>, geometry: &Geometry, cloud: &[[f64; 3]], band: &Band) -> Result<Vec<u32>> {
    let off = surface::distances_to(stage, &band.u, geometry, cloud)?;
    let is_lost = |(_, off): &(u32, &Option<f64>)| off.is_some_and(|off| off > LEFT_VOXELS * geometry.max_spacing());
    let lost: Vec<u32> = (0..).zip(&off).filter(is_lost).map(|(point, _)| point).collect();
    Ok(hold_sheets(geometry, cloud, &lost, Company::AT_THE_END, band))
}

/// Writes the fields on a grid: that of the band, or with a window one in which the band has that box.
fn write_fields(
    engine: &Engine,
    geometry: &Geometry,
    window: Option<Box3>,
    band: &Band,
    store: &StoreWriter,
) -> Result<()> {
    let farthest = f64::from(band.distance.absent(0));
    for (group, name, field, high, beyond) in [
        ("", "levelset", &band.u, 1.0, 0.0),
        ("distance", "distance", &band.distance, farthest, band.distance.absent(0)),
    ] {
        let spec = ImageSpec { name, geometry, element: ElementType::F32, window: Some([0.0, high]) };
        let stage = engine.stage(&format!("write {name}"), 0);
        stage.voxels(geometry.domain().volume());
        let on_grid = window.map(|window| OnGrid { field, window, shape: geometry.shape, beyond });
        let source: &dyn BoxSource<f32> = on_grid.as_ref().map_or(field as _, |on_grid| on_grid as _);
        write_levels::<f32>(&stage, engine, store.image(group, &spec)?.levels(), source, Reduce::Mean)?;
        stage.finish();
    }
    Ok(())
}

fn leaks(settings: &ReconstructSettings, saddle: f32) -> Error {
    let beta = settings.beta.unwrap_or_default();
    Error::input(format!(
        "with --beta {beta} the start leaks through a hole {:.4} wide; leave --beta out or give more than {saddle:.4}",
        2.0 * saddle
    ))
}

fn encloses_nothing(grid: &Geometry) -> Error {
    Error::input(format!(
        "the points enclose nothing at the spacing {}: no space inside is twice as deep as its widest opening; give a \
         finer --spacing if they lie denser than that, or points of all sides of the body",
        grid.min_spacing()
    ))
}
