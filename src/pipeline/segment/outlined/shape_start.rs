//! An object that starts as the shape of its outlines: its band, and the speed at which image and shape move it.

use std::sync::Arc;

use super::outlines::cloud;
use super::shape_field::ShapeField;
use super::speed::{Pulls, speed};
use super::survey::{Outlined, Trust};
use crate::error::Result;
use crate::exec::{Engine, Stage, Workers, one_wave, whole_field};
use crate::grid::{BrickGrid, BrickSet, Geometry, PointBins};
use crate::kernel::image::border::border_model::BorderModel;
use crate::kernel::image::border::speed::OF_AN_END;
use crate::kernel::level_set::cell::CELL;
use crate::kernel::level_set::initial::start;
use crate::kernel::outline::planar::section::{Section, widest_gap};
use crate::pipeline::distance::{Sources, cloud_distance};
use crate::pipeline::enclosure::needs::box_bytes;
use crate::pipeline::image::intensity::Normalised;
use crate::pipeline::image::terms::{EdgeSettings, presmooth};
use crate::pipeline::level_set::band::Band;
use crate::pipeline::marks::ObjectMarks;
use crate::pipeline::segment::begun::{Begun, Forces};
use crate::pipeline::segment::picture::{Picture, name};
use crate::pipeline::segment::settings::{ImageModel, SegmentSettings};
use crate::store::{BrickArray, Element};

/// The weight of the image beside its variance: that is measured with outlines left out, so from twice as far away as
/// anything between outlines is, and four times too large.
const RHO: f64 = 4.0;

/// The band reaches so many deviations of the shape from it, and within these bounds of smallest spacings.
const BAND_DEVIATIONS: f64 = 3.0;
pub(crate) const BAND: [f64; 2] = [5.0, 16.0];

/// A shape that is nowhere deeper than so many largest spacings cannot be moved on its grid.
const THIN: f64 = 1.5;

/// Starts an object from its outlines.
pub(crate) fn begin<T: Element>(
    engine: &Engine,
    picture: &Picture<'_, T>,
    marks: &ObjectMarks,
    (object, trust): (&Outlined, Trust),
    settings: &SegmentSettings,
) -> Result<(Begun, Forces)> {
    let h = picture.geometry.min_spacing();
    let sections: Vec<_> = object.sections.iter().collect();
    let reach = h * band_reach(object, &trust, h);
    let stage = engine.stage(&name("shape", marks), 0);
    let field = ShapeField::new(&stage, picture.geometry, &sections, &object.fitted, reach)?;
    let set = field.cells_within(&stage, reach)?;
    let cloud = cloud(&object.sections);
    // The shape's own box, which may be larger than the one around its marks.
    let held = engine.hold(box_bytes(cloud.len() as u64, set.grid().len(), set.len() as u64))?;
    let (shape, deepest) = field.on_cells(&stage, engine, &set)?;
    stage.voxels((set.len() * set.grid().brick_len()) as u64);
    stage.finish();
    let distance = distance_to(engine, marks, &field.geometry, &cloud, &set, settings)?;
    let spacing = field.geometry.max_spacing();
    let rests = deepest < THIN * spacing;
    let width = if rests { spacing as f32 } else { 0.0 };
    let by = AtShape { reach: reach as f32, range: pull_range(&trust, h) as f32, width };
    let stage = engine.stage(&name("band", marks), 0);
    let band = start_at(&stage, engine, [&shape, &distance], &by)?;
    stage.finish();
    let forces = if settings.image == ImageModel::Edge {
        Forces { theta: theta(&trust, settings), ..Forces::of_settings(settings) }
    } else {
        let fields = [&shape, &distance];
        let (rho, speed) = image_speed(engine, picture, marks, (object, trust), &field, fields, settings)?;
        let image_model = match trust.reading.model {
            BorderModel::Level => "level",
            BorderModel::Wall(_) => "wall",
            BorderModel::None => "none",
        };
        let theta = theta(&trust, settings);
        Forces { theta, rho, edges: false, speed: Some(speed), image_model: Some(image_model) }
    };
    let ShapeField { geometry, window, .. } = field;
    let begun = Begun {
        geometry,
        window,
        band,
        distance: Some(distance),
        cloud_points: cloud.len() as u64,
        beta: 0.0,
        hole: None,
        rests,
        held,
    };
    Ok((begun, forces))
}

/// The speed that image and shape give, and the image's weight in it.
fn image_speed<T: Element>(
    engine: &Engine,
    picture: &Picture<'_, T>,
    marks: &ObjectMarks,
    (object, trust): (&Outlined, Trust),
    field: &ShapeField<'_>,
    [shape, distance]: [&BrickArray<f32>; 2],
    settings: &SegmentSettings,
) -> Result<(f64, BrickArray<f32>)> {
    let model = trust.reading.model;
    let (rho, smoothed) = if model == BorderModel::None {
        (0.0, None)
    } else {
        let smoothed = smooth(engine, picture, marks, field, shape.set(), settings, model)?;
        (settings.rho.unwrap_or(RHO), Some(smoothed))
    };
    let stage = engine.stage(&name("speed", marks), 0);
    let pulls = Pulls { field, trust, rho, image: smoothed.as_ref(), shape, distance };
    let speed = speed(&stage, engine, object, &pulls)?;
    stage.finish();
    Ok((rho, speed))
}

/// How far from the shape the surface may go, in smallest spacings.
fn band_reach(object: &Outlined, trust: &Trust, h: f64) -> f64 {
    let gap = widest_gap(&object.sections);
    let radius = object.sections.iter().map(Section::radius).fold(0.0, f64::max);
    let farthest = if gap > 0.0 { 0.5 * gap } else { radius };
    let end = f64::from(OF_AN_END) * object.fitted.ends().map_or(0.0, |ends| ends.height()) / h;
    let unsure = libm::hypot(libm::hypot(trust.shape, trust.growth * (farthest / h).powi(2)), end);
    (BAND_DEVIATIONS * unsure + trust.reading.bias.abs()).clamp(BAND[0], BAND[1])
}

/// The outlines pull from so far, as they are as sure as that.
fn pull_range(trust: &Trust, h: f64) -> f64 {
    trust.shape.max(0.5) * h
}

/// The weight of the pull towards the outlines: what the image does not take over right beside them.
fn theta(trust: &Trust, settings: &SegmentSettings) -> f64 {
    let (shape, image) = (trust.shape.powi(2), trust.image.powi(2));
    let share = if image.is_finite() { image / (shape + image) } else { 1.0 };
    if trust.reading.bias == 0.0 { settings.theta.unwrap_or(1.0) * share } else { 0.0 }
}

fn distance_to(
    engine: &Engine,
    marks: &ObjectMarks,
    geometry: &Geometry,
    cloud: &[[f64; 3]],
    set: &Arc<BrickSet>,
    settings: &SegmentSettings,
) -> Result<BrickArray<f32>> {
    let bins = PointBins::new(BrickGrid::new(geometry.shape, CELL as i64), geometry, cloud);
    let sources = Sources::cloud(geometry, cloud, &bins);
    let stage = engine.resumable_stage(&name("distance", marks), 11 * set.len() as u64);
    stage.voxels((set.len() * set.grid().brick_len()) as u64);
    let farthest = geometry.length(geometry.shape);
    let part = cloud_distance(&stage, engine, &sources, set, settings.method, farthest as f32)?;
    let distance = whole_field(&stage, part, set)?;
    stage.finish();
    Ok(distance)
}

/// How a band starts at a shape; physical lengths.
struct AtShape {
    /// How far it reaches.
    reach: f32,
    /// Beyond this the outlines' pull fades.
    range: f32,
    /// Over how much u falls across the surface; 0 for a step.
    width: f32,
}

/// The band around a shape, started at it.
fn start_at(
    stage: &Stage<'_>,
    engine: &Engine,
    [shape, distance]: [&BrickArray<f32>; 2],
    by: &AtShape,
) -> Result<Band> {
    let set = shape.set();
    let new = || BrickArray::<f32>::with_faces(engine.scratch(), set);
    let mut band = Band { u: new()?, distance: new()?, solved: BrickArray::new(engine.scratch(), set)?, voxels: 0 };
    for id in (0..set.grid().len()).filter(|&id| set.slot(id).is_none()) {
        band.u.set_absent(id, start::value(u8::from(shape.absent(id) < 0.0)));
        band.distance.set_absent(id, by.range);
    }
    let edge = set.grid().edge() as usize;
    let counts = stage.run(&one_wave(set), &Workers::none(), |(), &slot| {
        let valid = set.grid().brick_box(set.id(slot)).shape().map(|n| n as usize);
        let count = shape.read(slot, |shape| {
            band.u.write(slot, |u| start::from_shape(shape, by.width, u));
            band.solved.write(slot, |solved| start::near_surface(shape, edge, valid, by.reach, solved))
        });
        distance.read(slot, |d| band.distance.write(slot, |pull| start::fading(d, by.range, pull)));
        band.u.refresh_faces(slot);
        band.distance.refresh_faces(slot);
        Ok(count)
    })?;
    band.voxels = counts.iter().sum();
    stage.voxels(band.voxels);
    Ok(band)
}

/// Widths of the smoothing before levels and walls are looked for, in smallest spacings.
const LEVEL_SIGMA: f64 = 1.0;
const WALL_SIGMA: f64 = 1.0;

fn smooth<T: Element>(
    engine: &Engine,
    picture: &Picture<'_, T>,
    marks: &ObjectMarks,
    field: &ShapeField<'_>,
    set: &Arc<BrickSet>,
    settings: &SegmentSettings,
    model: BorderModel,
) -> Result<BrickArray<f32>> {
    let h = field.geometry.min_spacing();
    let usual = if model == BorderModel::Level { LEVEL_SIGMA } else { WALL_SIGMA };
    let sigma = settings.sigma.unwrap_or(usual * h);
    let image = Normalised::new(picture.voxels, picture.range, field.window);
    let stage = engine.stage(&name("presmoothing", marks), 0);
    let how = EdgeSettings { smoothing: settings.smoothing, sigma, k: settings.k as f32 };
    let smoothed = presmooth(&stage, engine, &image, set, field.geometry.spacing, &how)?;
    stage.finish();
    Ok(smoothed)
}
