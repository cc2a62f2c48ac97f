//! One object: from its marks to the segmentation function on a box of its own.

use std::sync::Arc;

use super::settings::SegmentSettings;
use super::vicinity::{Vicinity, first_reach, voxel_bounds};
use crate::error::{Error, Result};
use crate::exec::Engine;
use crate::grid::{Box3, Geometry};
use crate::kernel::image::grey_range::GreyRange;
use crate::kernel::surface::{Hausdorff, Measures};
use crate::pipeline::band::{Band, Reaches, make_band};
use crate::pipeline::distance::{Sources, cloud_distance};
use crate::pipeline::evolve::{Evolution, evolve};
use crate::pipeline::image_terms::{EdgeSettings, edges, presmooth};
use crate::pipeline::intensity::Normalised;
use crate::pipeline::marks::{ObjectMarks, cloud_of};
use crate::pipeline::tagging::{Basin, Tagging, tag};
use crate::store::{BoxSource, BrickArray, Element};

/// The image as the objects see it.
pub(super) struct Picture<'a, T: Element> {
    /// Its voxels.
    pub voxels: &'a dyn BoxSource<T>,
    /// The grey values taken as black and white.
    pub range: GreyRange,
    /// Where it lies.
    pub geometry: &'a Geometry,
}

/// The hole through which a cloud would leak first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hole {
    /// Its width: twice the saddle's distance to the cloud.
    pub width: f64,
    /// Where it is, world coordinates.
    pub place: [f64; 3],
}

/// What is reported of a solved object.
#[derive(Clone, Debug)]
pub struct ObjectReport {
    /// The object's number, its label.
    pub label: u32,
    /// Points of the cloud that its marks stand for.
    pub cloud_points: u64,
    /// Where the start surface lay.
    pub beta: f64,
    /// The cloud's largest hole.
    pub hole: Option<Hole>,
    /// Number of voxels that were solved.
    pub band_voxels: u64,
    /// How the time loop ended.
    pub evolution: Evolution,
    /// The surface's measures.
    pub measures: Measures,
    /// Distances of the marks from the surface.
    pub hausdorff: Option<Hausdorff>,
}

/// A solved object before its surface is drawn.
pub(super) struct Solution {
    /// The grid of its box.
    pub geometry: Geometry,
    /// Its box in voxels of the image; may reach past it.
    pub window: Box3,
    /// The segmentation function.
    pub u: BrickArray<f32>,
    /// Distance to the cloud in the band; constant, the largest that was looked at, beyond.
    pub distance: BrickArray<f32>,
    /// Points of the cloud.
    pub cloud_points: u64,
    /// Where the start surface lay.
    pub beta: f64,
    /// The cloud's largest hole.
    pub hole: Option<Hole>,
    /// Number of voxels that were solved.
    pub band_voxels: u64,
    /// How the time loop ended.
    pub evolution: Evolution,
}

/// The start surface lies a little beyond the largest saddle, and at least so many smallest spacings from the cloud.
const ABOVE_SADDLE: f64 = 1.05;
const SMALLEST_BETA_VOXELS: f64 = 0.75;
/// The band reaches at least so many mean spacings to either side of the cloud.
const BAND_VOXELS: f64 = 4.0;

/// Solves one object.
///
/// # Errors
/// When its marks enclose nothing, scratch runs out or the run is interrupted.
pub(super) fn solve<T: Element>(
    engine: &Engine,
    picture: &Picture<'_, T>,
    marks: &ObjectMarks,
    settings: &SegmentSettings,
) -> Result<Solution> {
    let cloud = cloud_of(marks, picture.geometry, settings.caps);
    let enclosure = enclose(engine, picture.geometry, marks, &cloud, settings)?;
    let Enclosure { geometry, window, distance, tagging, reaches } = enclosure;
    let stage = engine.stage(&name("band", marks), tagging.level.set().len() as u64);
    let mut band = make_band(&stage, engine, &distance, &tagging.level, &reaches)?;
    stage.finish();
    let hole = tagging
        .basins
        .iter()
        .max_by(|a, b| a.saddle.total_cmp(&b.saddle))
        .map(|basin| Hole { width: 2.0 * f64::from(basin.saddle), place: geometry.position(basin.place) });
    drop((distance, tagging));
    let edge_field = edge_field(engine, picture, marks, settings, &geometry, window, &band)?;
    let stage = engine.stage(&name("level set", marks), 0);
    stage.voxels(band.voxels);
    let settings = settings.time_loop(&geometry);
    let evolution = evolve(&stage, engine, &mut band, edge_field.as_ref(), geometry.spacing, &settings)?;
    stage.finish();
    let Band { u: [u, _], distance, voxels: band_voxels, .. } = band;
    Ok(Solution {
        geometry,
        window,
        u,
        distance,
        cloud_points: cloud.len() as u64,
        beta: f64::from(reaches.beta),
        hole,
        band_voxels,
        evolution,
    })
}

fn name(what: &str, marks: &ObjectMarks) -> String {
    format!("{what} {}", marks.object)
}

fn edge_field<T: Element>(
    engine: &Engine,
    picture: &Picture<'_, T>,
    marks: &ObjectMarks,
    settings: &SegmentSettings,
    geometry: &Geometry,
    window: Box3,
    band: &Band,
) -> Result<Option<BrickArray<f32>>> {
    if settings.rho == 0.0 {
        return Ok(None);
    }
    let image = Normalised::new(picture.voxels, picture.range, window);
    let (set, spacing) = (band.solved.set(), geometry.spacing);
    let EdgeSettings { sigma, k } = settings.edges(geometry);
    let stage = engine.stage(&name("presmoothing", marks), 0);
    let smoothed = presmooth(&stage, engine, &image, set, spacing, sigma)?;
    stage.finish();
    let stage = engine.stage(&name("edges", marks), set.len() as u64);
    let found = edges(&stage, engine, &smoothed, set, spacing, k)?;
    stage.finish();
    Ok(Some(found))
}

/// A cloud that encloses something, on a grid that reaches far enough around it.
struct Enclosure {
    geometry: Geometry,
    window: Box3,
    distance: BrickArray<f32>,
    tagging: Tagging,
    reaches: Reaches,
}

/// Looks for what the cloud encloses, within a distance that grows until it is found or nothing can be.
fn enclose(
    engine: &Engine,
    image: &Geometry,
    marks: &ObjectMarks,
    cloud: &[[f64; 3]],
    settings: &SegmentSettings,
) -> Result<Enclosure> {
    let bounds = voxel_bounds(cloud, image);
    let extent = (0..3).map(|a| bounds.shape()[a] as f64 * image.spacing[a]).fold(0.0, f64::max);
    let mean = image.voxel_volume().cbrt();
    let mut farthest = first_reach(marks, image, settings);
    loop {
        let around = Vicinity::new(image, cloud, farthest);
        let (geometry, window) = (around.geometry.clone(), around.window);
        let (distance, tagging) = flood_within(engine, marks, cloud, around, settings, farthest)?;
        let beta = settings.beta.or_else(|| automatic_beta(&tagging.basins, image));
        let Some(beta) = beta.filter(|&beta| tagging.basins.iter().any(|b| f64::from(b.saddle) < beta)) else {
            if farthest > extent || (settings.beta.is_some() && !tagging.basins.is_empty()) {
                return Err(leak(marks, settings, &tagging.basins, image));
            }
            farthest *= 2.0;
            continue;
        };
        let half_width = (2.0 * beta).max(BAND_VOXELS * mean);
        let outer = (beta + 0.5 * half_width).max(half_width);
        if half_width.max(outer) + 2.0 * image.max_spacing() > farthest {
            farthest = half_width.max(outer) + 3.0 * image.max_spacing();
            continue;
        }
        let reaches = Reaches { beta: beta as f32, inner: half_width as f32, outer: outer as f32 };
        return Ok(Enclosure { geometry, window, distance, tagging, reaches });
    }
}

fn flood_within(
    engine: &Engine,
    marks: &ObjectMarks,
    cloud: &[[f64; 3]],
    around: Vicinity,
    settings: &SegmentSettings,
    farthest: f64,
) -> Result<(BrickArray<f32>, Tagging)> {
    let set = Arc::new(around.cells);
    let voxels = (set.len() * set.grid().brick_len()) as u64;
    let sources = Sources::cloud(&around.geometry, cloud, &around.bins);
    let stage = engine.stage(&name("distance", marks), 11 * set.len() as u64);
    stage.voxels(voxels);
    let distance = cloud_distance(&stage, engine, &sources, &set, settings.method, farthest as f32)?;
    stage.finish();
    let stage = engine.stage(&name("tagging", marks), 0);
    stage.voxels(voxels);
    let tagging = tag(&stage, engine, &sources, &distance)?;
    stage.finish();
    Ok((distance, tagging))
}

fn automatic_beta(basins: &[Basin], image: &Geometry) -> Option<f64> {
    let saddle = basins.iter().map(|b| f64::from(b.saddle)).reduce(f64::max)?;
    Some((ABOVE_SADDLE * saddle).max(SMALLEST_BETA_VOXELS * image.min_spacing()))
}

fn leak(marks: &ObjectMarks, settings: &SegmentSettings, basins: &[Basin], image: &Geometry) -> Error {
    let object = marks.object;
    let unit = image.unit.as_deref().unwrap_or("(no unit)");
    match (settings.beta, basins.iter().map(|b| b.saddle).reduce(f32::min)) {
        (Some(beta), Some(saddle)) => Error::input(format!(
            "with --beta {beta} the start of object {object} leaks through a hole {:.3} {unit} wide; leave --beta out or \
             give more than {saddle:.3}",
            2.0 * saddle
        )),
        _ => Error::input(format!(
            "the marks of object {object} enclose nothing at this spacing; mark its border all around, on every few \
             slices, in the order of the contour"
        )),
    }
}
