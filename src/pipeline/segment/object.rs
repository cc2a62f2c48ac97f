//! One object: from its marks to the segmentation function on a box of its own.

use super::outlines::not_flat;
use super::reach::first_reach;
use super::seed::grow;
use super::settings::{ImageModel, SegmentSettings, Start};
use super::shape_start::begin;
use super::survey::{Outlined, Trust};
use crate::error::{Error, Result};
use crate::exec::Engine;
use crate::grid::{Box3, Geometry, digits};
use crate::kernel::image::grey_range::GreyRange;
use crate::kernel::surface::{Hausdorff, Measures};
use crate::pipeline::band::Band;
use crate::pipeline::enclosure::{self, Deepest, Found, Hole, Search, enclose};
use crate::pipeline::evolve::{Evolution, evolve};
use crate::pipeline::image_terms::{edges, presmooth};
use crate::pipeline::intensity::Normalised;
use crate::pipeline::marks::{ObjectMarks, cloud_of};
use crate::store::{BoxSource, BrickArray, Element};

/// The image as the objects see it.
#[derive(Clone, Copy)]
pub(super) struct Picture<'a, T: Element> {
    /// Its voxels.
    pub voxels: &'a dyn BoxSource<T>,
    /// The grey values taken as black and white.
    pub range: GreyRange,
    /// Where it lies.
    pub geometry: &'a Geometry,
    /// Where it lies in truth, for messages.
    pub world: World<'a>,
}

/// Where a picture lies that is solved as if its first voxel were the origin.
#[derive(Clone, Copy)]
pub(super) struct World<'a> {
    /// The grid of the whole image.
    pub whole: &'a Geometry,
    /// The world position of the picture's origin.
    pub origin: [f64; 3],
}

impl World<'_> {
    /// A hole in an object's marks: how wide it is, and where; with the slice, where it is none beyond the image.
    fn told(&self, hole: &Hole) -> String {
        let whole = self.whole;
        let place: [f64; 3] = std::array::from_fn(|a| hole.place[a] + self.origin[a]);
        let slice = whole.to_voxels(place)[2].round();
        let last = (whole.shape[2] - 1) as f64;
        let on = if (0.0..=last).contains(&slice) {
            format!("on slice {slice} (counted from 0)")
        } else {
            let (end, which) = if slice < 0.0 { (0.0, "first") } else { (last, "last") };
            format!("beyond the {which} slice ({end}, counted from 0)")
        };
        let unit = whole.unit.as_deref().unwrap_or("(no unit)");
        let width = digits::number(hole.width);
        format!("a hole {width} {unit} wide at {}, {on}", digits::place(place, whole.min_spacing()))
    }
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
    /// Marks that are farther from it than the largest spacing.
    pub marks_off: u64,
    /// What was taken from the image: `level`, `wall`, `edge`, `none`.
    pub image_model: &'static str,
    /// Weight of the pull towards the marks.
    pub theta: f64,
    /// Weight of the image.
    pub rho: f64,
    /// How far outlines that are left out lie from the shape of the others, where that was asked for.
    pub cross_validation: Option<CrossValidation>,
}

/// What leaving out each outline in turn tells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrossValidation {
    /// Mean distance of the marks that were left out.
    pub mean: f64,
    /// Nine of ten are nearer than this.
    pub p90: f64,
    /// Where the next outline would help most: the axis that its slice is across, and the slice.
    pub next_slice: Option<(usize, i64)>,
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
    /// A larger beta that may do where this one does not.
    pub larger_beta: Option<f64>,
    /// The cloud's largest hole.
    pub hole: Option<Hole>,
    /// Number of voxels that were solved.
    pub band_voxels: u64,
    /// How the time loop ended.
    pub evolution: Evolution,
    /// What was taken from the image.
    pub image_model: &'static str,
    /// Weight of the pull towards the marks.
    pub theta: f64,
    /// Weight of the image.
    pub rho: f64,
}

impl Solution {
    /// The solution, moved in the world.
    pub(super) fn moved(mut self, by: [f64; 3]) -> Self {
        let moved = |p: [f64; 3]| std::array::from_fn(|a| p[a] + by[a]);
        self.geometry.origin = moved(self.geometry.origin);
        self.hole = self.hole.map(|hole| Hole { place: moved(hole.place), ..hole });
        self
    }
}

/// Solves one object.
///
/// # Errors
/// When its marks enclose nothing, scratch runs out or the run is interrupted.
pub(super) fn solve<T: Element>(
    engine: &Engine,
    picture: &Picture<'_, T>,
    marks: &ObjectMarks,
    outlined: Option<(&Outlined, Trust)>,
    settings: &SegmentSettings,
) -> Result<Solution> {
    if outlined.is_none() && matches!(settings.image, ImageModel::Level | ImageModel::Wall) {
        return Err(needs_outlines(marks, settings));
    }
    if let Some(seed) = marks.seed {
        return grow(engine, picture, marks, &seed, settings);
    }
    if let Some(outlined) = outlined {
        let (begun, forces) = begin(engine, picture, marks, outlined, settings)?;
        return begun.solve(engine, picture, marks, settings, &forces);
    }
    let cloud = cloud_of(marks, picture.geometry, settings.caps);
    let loose = settings.start == Start::Auto && !marks.drawn;
    let suffix = format!(" {}", marks.object);
    let search = Search {
        grid: picture.geometry,
        cloud: &cloud,
        method: settings.method,
        beta: settings.beta,
        start: if loose { enclosure::Start::Watershed } else { enclosure::Start::Tube },
        first_reach: first_reach(marks, picture.geometry, settings),
        suffix: &suffix,
    };
    let enclosure = match enclose(engine, &search)? {
        Found::Enclosed(enclosure) => enclosure,
        Found::Leaks(deepest) => return Err(leak(marks, settings, &deepest, picture.world)),
        Found::Nothing(deepest) => return Err(encloses_nothing(marks, picture, deepest.as_ref())),
    };
    let (geometry, window, hole) = (enclosure.geometry.clone(), enclosure.window, enclosure.hole());
    let (beta, larger_beta) = (enclosure.beta, enclosure.larger_beta());
    let band = enclosure.into_band(engine, &suffix)?;
    // Marks that a cloud is made of are dense, and edges make results worse where marks are good.
    let edges = !loose || settings.image == ImageModel::Edge;
    let forces = Forces { edges: edges && settings.uses_image(), ..Forces::of_settings(settings) };
    let begun =
        Begun { geometry, window, band, distance: None, cloud_points: cloud.len() as u64, beta, hole, rests: false };
    Ok(Solution { larger_beta, ..begun.solve(engine, picture, marks, settings, &forces)? })
}

/// What moves an object's surface, beside its curvature and the settings.
pub(super) struct Forces {
    /// Weight of the pull towards the marks.
    pub theta: f64,
    /// Weight of the image.
    pub rho: f64,
    /// True where the image's edges pull.
    pub edges: bool,
    /// Speed outwards; none where the image's edges pull, or nothing.
    pub speed: Option<BrickArray<f32>>,
    /// What the image shows, where that is known.
    pub image_model: Option<&'static str>,
}

impl Forces {
    /// Those of the settings: the marks, and the image's edges.
    pub(super) fn of_settings(settings: &SegmentSettings) -> Self {
        let (theta, rho) = (settings.motion.theta, settings.motion.rho);
        Self { theta, rho, edges: settings.uses_image(), speed: None, image_model: None }
    }
}

/// An object before its surface moves.
pub(super) struct Begun {
    /// The grid of its box.
    pub geometry: Geometry,
    /// Its box in voxels of the image; may reach past it.
    pub window: Box3,
    /// What is solved, at its start.
    pub band: Band,
    /// The distance to the cloud, where something else takes its place in the band.
    pub distance: Option<BrickArray<f32>>,
    /// Points of the cloud.
    pub cloud_points: u64,
    /// Where the start surface lies.
    pub beta: f64,
    /// The cloud's largest hole.
    pub hole: Option<Hole>,
    /// True where it is too thin for the grid to move, and stays what its outlines say.
    pub rests: bool,
}

impl Begun {
    /// Finds the image's edges around it and moves its surface to them.
    pub(super) fn solve<T: Element>(
        self,
        engine: &Engine,
        picture: &Picture<'_, T>,
        marks: &ObjectMarks,
        settings: &SegmentSettings,
        forces: &Forces,
    ) -> Result<Solution> {
        let Self { geometry, window, mut band, distance, cloud_points, beta, hole, rests } = self;
        let look = || edge_field(engine, picture, marks, settings, &geometry, window, &band);
        let edges = forces.edges.then(look).transpose()?;
        let mut time_loop = settings.motion.time_loop(&geometry);
        time_loop.velocity.theta = forces.theta as f32;
        time_loop.velocity.speed = forces.speed.is_some();
        let image = forces.speed.as_ref().or(edges.as_ref());
        if forces.speed.is_some() || image.is_none() {
            time_loop.velocity.rho = f32::from(u8::from(image.is_some()));
        }
        let stage = engine.stage(&name("level set", marks), 0);
        stage.voxels(band.voxels);
        let evolution = if rests {
            Evolution { steps: 0, sor_iterations: 0, stopped_by: "too thin", residual: 0.0 }
        } else {
            evolve(&stage, engine, &mut band, image, geometry.spacing, &time_loop)?
        };
        stage.finish();
        let Band { u, distance: pull, voxels: band_voxels, .. } = band;
        let distance = distance.unwrap_or(pull);
        let (theta, rho) = (forces.theta, forces.rho);
        let image_model = forces.image_model.unwrap_or(if edges.is_some() { "edge" } else { "none" });
        Ok(Solution {
            geometry,
            window,
            u,
            distance,
            cloud_points,
            beta,
            larger_beta: None,
            hole,
            band_voxels,
            evolution,
            image_model,
            theta,
            rho,
        })
    }
}

pub(super) fn name(what: &str, marks: &ObjectMarks) -> String {
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
) -> Result<BrickArray<f32>> {
    let image = Normalised::new(picture.voxels, picture.range, window);
    let (set, spacing) = (band.solved.set(), geometry.spacing);
    let detector = settings.edges(geometry);
    let stage = engine.stage(&name("presmoothing", marks), 0);
    let smoothed = presmooth(&stage, engine, &image, set, spacing, &detector)?;
    stage.finish();
    let stage = engine.stage(&name("edges", marks), set.len() as u64);
    let found = edges(&stage, engine, &smoothed, set, spacing, detector.k)?;
    stage.finish();
    Ok(found)
}

fn needs_outlines(marks: &ObjectMarks, settings: &SegmentSettings) -> Error {
    let model = if settings.image == ImageModel::Wall { "wall" } else { "level" };
    Error::input(format!(
        "object {} has no outlines along which --image {model} could read grey values; name its contours in a contour \
         column, each in a plane, and leave out --start flood and --beta, or give --image edge",
        marks.object
    ))
}

fn leak(marks: &ObjectMarks, settings: &SegmentSettings, deepest: &Deepest, world: World<'_>) -> Error {
    let (object, beta) = (marks.object, settings.beta.unwrap_or_default());
    let larger = deepest.beta().map_or(String::new(), |beta| format!(", or give --beta {beta}"));
    Error::input(format!(
        "with --beta {beta} the start of object {object} leaks through {}; leave --beta out{larger}",
        world.told(&deepest.hole)
    ))
}

fn encloses_nothing<T: Element>(marks: &ObjectMarks, picture: &Picture<'_, T>, deepest: Option<&Deepest>) -> Error {
    let (object, image) = (marks.object, picture.geometry);
    // A hole, and what closes it, are worth telling where the flood found any space at all.
    let told = deepest.and_then(|deepest| Some((deepest, deepest.beta()?)));
    let hole = told.map_or(String::new(), |(deepest, beta)| {
        format!(", or give --beta {beta}: the deepest space has {}", picture.world.told(&deepest.hole))
    });
    if !marks.drawn {
        return Error::input(format!(
            "the points of object {object} enclose nothing at this spacing; where they are outlines, give each a number in \
             a column named contour (object,contour,x,y,z): without it they are one loose cloud, which needs points all \
             around{hole}"
        ));
    }
    if let Some(number) = not_flat(marks, image) {
        return Error::input(format!(
            "contour {number} of object {object} lies in no plane, so it is no outline, and as points its marks enclose \
             nothing; give the outline of each slice a contour number of its own"
        ));
    }
    Error::input(format!(
        "the marks of object {object} enclose nothing at this spacing; mark its border all around, on every few \
         slices, in the order of the contour{hole}"
    ))
}
