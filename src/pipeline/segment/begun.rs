//! An object at the start of its time loop: its band, and what moves its surface.

use super::picture::{Picture, name};
use super::settings::SegmentSettings;
use crate::error::Result;
use crate::exec::{Engine, Hold};
use crate::grid::{Box3, Geometry};
use crate::pipeline::enclosure::search::Hole;
use crate::pipeline::image::intensity::Normalised;
use crate::pipeline::image::terms::{edges, presmooth};
use crate::pipeline::level_set::band::Band;
use crate::pipeline::level_set::growing::Growing;
use crate::pipeline::level_set::ranks::evolve_on_ranks;
use crate::pipeline::level_set::time_loop::Evolution;
use crate::pipeline::marks::ObjectMarks;
use crate::store::{BrickArray, Element};

/// What moves an object's surface, beside its curvature and the settings.
pub(crate) struct Forces {
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
pub(crate) struct Begun {
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
    /// What its box takes of the memory.
    pub held: Hold,
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
        let Self { geometry, window, mut band, distance, cloud_points, beta, hole, rests, held: _held } = self;
        let look = || edge_field(engine, picture, marks, settings, &geometry, window, &band);
        let edges = forces.edges.then(look).transpose()?;
        let mut time_loop = settings.motion.time_loop(&geometry);
        time_loop.velocity.theta = forces.theta as f32;
        time_loop.velocity.speed = forces.speed.is_some();
        let image = forces.speed.as_ref().or(edges.as_ref());
        if forces.speed.is_some() || image.is_none() {
            time_loop.velocity.rho = f32::from(u8::from(image.is_some()));
        }
        let stage = engine.resumable_stage(&name("level set", marks), 0);
        stage.voxels(band.voxels);
        let evolution = if rests {
            Evolution {
                steps: 0,
                sor_iterations: 0,
                stopped_by: "too thin".into(),
                residual: 0.0,
                residuals: Vec::new(),
            }
        } else {
            let shown = Geometry { origin: picture.world.of(geometry.origin), ..geometry.clone() };
            let mut growing = Growing::of(picture.shown_in, &format!("object-{}", marks.object), &shown)?;
            evolve_on_ranks(&stage, engine, &mut band, image, geometry.spacing, &time_loop, growing.as_mut())?
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

/// A solved object before its surface is drawn.
pub(crate) struct Solution {
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
