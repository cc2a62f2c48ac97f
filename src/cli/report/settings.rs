//! The settings of a segmentation, and how a surface was to move and did, as reports tell them.

use serde::Serialize;

use crate::cli::report::neighbours::fill_gaps;
use crate::grid::Geometry;
use crate::pipeline::image::terms::Smoothing;
use crate::pipeline::level_set::motion::Motion;
use crate::pipeline::level_set::time_loop::{Evolution, Stop};
use crate::pipeline::segment::{Overlap, SegmentSettings};

/// Every setting, also those that nobody gave; lengths physical.
#[derive(Debug, Serialize)]
pub(crate) struct Settings {
    pub(crate) image: String,
    pub(crate) points: Vec<String>,
    /// Balls that objects without points start as: x, y, z, radius.
    pub(crate) seeds: Vec<[f64; 4]>,
    pub(crate) output: Option<String>,
    /// How the store's chunks are packed.
    pub(crate) compress: &'static str,
    pub(crate) ome: &'static str,
    pub(crate) channel: u32,
    pub(crate) time: u32,
    pub(crate) level: u32,
    /// What the pages were said to be; null when it is the file's word.
    pub(crate) axes: Option<String>,
    pub(crate) image_index: Option<u32>,
    /// First voxel and one past the last, x, y, z.
    pub(crate) crop_xyz: [[i64; 2]; 3],
    pub(crate) image_type: &'static str,
    #[serde(flatten)]
    pub(crate) solver: Solver,
    pub(crate) scratch: String,
}

#[derive(Debug, Serialize)]
pub(crate) struct Solver {
    method: &'static str,
    #[serde(flatten)]
    motion: Moves,
    image_model: &'static str,
    start: &'static str,
    /// Null when it follows from what each object shows; it is then in the results.
    rho: Option<f64>,
    k: f64,
    smoothing: &'static str,
    /// Null when it follows from what each object shows.
    sigma: Option<f64>,
    /// Null when it was found for each object; it is then in the results.
    beta: Option<f64>,
    edge: &'static str,
    caps: bool,
    percentiles: [f64; 2],
    overlap: &'static str,
    /// A width, `auto`, or null.
    fill_gaps: serde_json::Value,
    brick: i64,
}

impl Solver {
    pub(crate) fn new(settings: &SegmentSettings, geometry: &Geometry) -> Self {
        Self {
            method: settings.method.name(),
            motion: Moves::new(&settings.motion, geometry),
            image_model: settings.image.name(),
            start: settings.start.name(),
            rho: settings.rho,
            k: settings.k,
            smoothing: match settings.smoothing {
                Smoothing::Gaussian => "gaussian",
                Smoothing::Heat => "heat",
            },
            sigma: settings.sigma,
            beta: settings.beta,
            edge: if settings.motion.normalised { "normalised" } else { "plain" },
            caps: settings.caps,
            percentiles: settings.percentiles,
            overlap: match settings.overlap {
                Overlap::Smaller => "smaller",
                Overlap::Larger => "larger",
                Overlap::First => "first",
                Overlap::Last => "last",
            },
            fill_gaps: fill_gaps(settings.fill_gaps),
            brick: settings.brick,
        }
    }
}

/// How the surface moved.
#[derive(Debug, Serialize)]
pub(crate) struct Moves {
    theta: f64,
    delta: f64,
    tau: f64,
    epsilon: f64,
    omega: f64,
    stop: &'static str,
    tol: f64,
    max_steps: u32,
}

impl Moves {
    pub(crate) fn new(motion: &Motion, geometry: &Geometry) -> Self {
        let (Stop::Surface(tol) | Stop::L2(tol)) = motion.stop;
        Self {
            theta: motion.theta,
            delta: motion.delta_on(geometry),
            tau: motion.tau_on(geometry),
            epsilon: motion.epsilon_on(geometry),
            omega: motion.omega,
            stop: motion.stop.name(),
            tol,
            max_steps: motion.max_steps,
        }
    }
}

/// How its motion ended.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Moved {
    time_steps: u32,
    sor_iterations: u64,
    stopped_by: String,
    residual: f64,
    /// What the rule that ends the motion looked at after each time step.
    residuals: Vec<f64>,
}

impl From<&Evolution> for Moved {
    fn from(evolution: &Evolution) -> Self {
        Self {
            time_steps: evolution.steps,
            sor_iterations: evolution.sor_iterations,
            stopped_by: evolution.stopped_by.to_string(),
            residual: evolution.residual,
            residuals: evolution.residuals.clone(),
        }
    }
}
