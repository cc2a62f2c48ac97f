//! Settings of `segment`, and what they are when the user gives none. Lengths are physical.

use super::labels::Overlap;
use crate::grid::{Geometry, PointCloud};
use crate::kernel::level_set::covolume::Velocity;
use crate::pipeline::distance::Method;
use crate::pipeline::evolve::{Stop, TimeLoop};
use crate::pipeline::image_terms::EdgeSettings;

/// What the user may set; `None` leaves a length to the image's spacing.
#[derive(Clone, Debug, PartialEq)]
pub struct SegmentSettings {
    /// Distance method.
    pub method: Method,
    /// Weight of the attraction to the points.
    pub theta: f64,
    /// Weight of the attraction to the image's edges.
    pub rho: f64,
    /// Weight of the curvature, a length.
    pub delta: Option<f64>,
    /// Contrast parameter of the edge detector.
    pub k: f64,
    /// Width of the presmoothing, a length.
    pub sigma: Option<f64>,
    /// Distance of the start surface from the cloud; automatic when none.
    pub beta: Option<f64>,
    /// Time step.
    pub tau: Option<f64>,
    /// Regularisation of gradient norms, one over a length.
    pub epsilon: Option<f64>,
    /// Over-relaxation.
    pub omega: f64,
    /// When the time loop ends.
    pub stop: Stop,
    /// Time steps at most.
    pub max_steps: u32,
    /// True to divide the edge term by the norm of grad g.
    pub normalised: bool,
    /// True to cap the ends of contour stacks.
    pub caps: bool,
    /// Percentages of the image's values taken as black and white.
    pub percentiles: [f64; 2],
    /// Which object a voxel belongs to where several overlap.
    pub overlap: Overlap,
    /// Edge of the bricks that hold the image.
    pub brick: i64,
}

impl Default for SegmentSettings {
    fn default() -> Self {
        Self {
            method: Method::VDT,
            theta: 1.0,
            rho: 0.3,
            delta: None,
            k: 650.0,
            sigma: None,
            beta: None,
            tau: None,
            epsilon: None,
            omega: 1.2,
            stop: Stop::Surface(0.02),
            max_steps: 60,
            normalised: true,
            caps: true,
            percentiles: [0.1, 99.9],
            overlap: Overlap::Smaller,
            brick: 64,
        }
    }
}

/// Voxels of the smallest spacing that the curvature's weight, the presmoothing and a time step span by default.
const DELTA_VOXELS: f64 = 0.1;
const SIGMA_VOXELS: f64 = 2.0;
const TAU_VOXELS: f64 = 0.5;
/// Gradients of u below this, per smallest spacing, count as flat.
const EPSILON_PER_VOXEL: f64 = 1e-2;

impl SegmentSettings {
    /// The curvature's weight on a grid.
    #[must_use]
    pub fn delta_on(&self, geometry: &Geometry) -> f64 {
        self.delta.unwrap_or(DELTA_VOXELS * geometry.min_spacing())
    }

    /// The width of the presmoothing on a grid.
    #[must_use]
    pub fn sigma_on(&self, geometry: &Geometry) -> f64 {
        self.sigma.unwrap_or(SIGMA_VOXELS * geometry.min_spacing())
    }

    /// The time step on a grid.
    #[must_use]
    pub fn tau_on(&self, geometry: &Geometry) -> f64 {
        self.tau.unwrap_or(TAU_VOXELS * geometry.min_spacing())
    }

    /// The regularisation of gradient norms on a grid.
    #[must_use]
    pub fn epsilon_on(&self, geometry: &Geometry) -> f64 {
        self.epsilon.unwrap_or(EPSILON_PER_VOXEL / geometry.min_spacing())
    }

    /// The time loop for a grid.
    #[must_use]
    pub fn time_loop(&self, geometry: &Geometry) -> TimeLoop {
        TimeLoop {
            velocity: Velocity {
                theta: self.theta as f32,
                rho: self.rho as f32,
                delta: self.delta_on(geometry) as f32,
                epsilon: self.epsilon_on(geometry) as f32,
                tau: self.tau_on(geometry) as f32,
                normalised: self.normalised,
            },
            stop: self.stop,
            max_steps: self.max_steps,
            omega: self.omega as f32,
            solver_tolerance: 1e-3,
        }
    }

    /// The edge detector for a grid.
    #[must_use]
    pub fn edges(&self, geometry: &Geometry) -> EdgeSettings {
        EdgeSettings { sigma: self.sigma_on(geometry), k: self.k as f32 }
    }
}

/// What guides a segmentation: where the image lies and what was marked on it.
pub struct Guides<'a> {
    /// The grid of the part of the image that is segmented.
    pub geometry: &'a Geometry,
    /// The marks, physical coordinates.
    pub cloud: &'a PointCloud,
}
