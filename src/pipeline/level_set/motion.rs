//! How a surface moves: what pulls it, in which steps, until when. Lengths are physical; those that nobody gave follow
//! from the grid's spacing.

use super::time_loop::{Stop, TimeLoop};
use crate::error::Result;
use crate::grid::Geometry;
use crate::kernel::level_set::scheme::velocity::Velocity;
use crate::pipeline::limits::{ABOVE_ZERO, AT_LEAST_ZERO, BETWEEN_ZERO_AND_TWO, check, check_given};

/// What the user may set; `None` leaves a length to the spacing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// Weight of the attraction to the points.
    pub theta: f64,
    /// Weight of the attraction to the image's edges.
    pub rho: f64,
    /// True to divide the edge term by the norm of grad g.
    pub normalised: bool,
    /// Weight of the curvature, a length.
    pub delta: Option<f64>,
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
}

impl Default for Motion {
    fn default() -> Self {
        Self {
            theta: 1.0,
            rho: 0.3,
            normalised: true,
            delta: None,
            tau: None,
            epsilon: None,
            omega: 1.2,
            stop: Stop::Surface(0.02),
            max_steps: 60,
        }
    }
}

/// Voxels of the smallest spacing that the curvature's weight and a time step span by default.
const DELTA_VOXELS: f64 = 0.1;
const TAU_VOXELS: f64 = 0.5;
/// Gradients of u below this, per smallest spacing, count as flat.
const EPSILON_PER_VOXEL: f64 = 1e-2;
/// A step is solved when what is left to correct is below this, root mean square.
const SOLVER_TOLERANCE: f64 = 1e-3;

impl Motion {
    /// Refuses numbers with which no surface moves.
    ///
    /// # Errors
    /// With the setting and what it may be.
    pub fn check(&self) -> Result<()> {
        check("--rho", self.rho, AT_LEAST_ZERO)?;
        check("--theta", self.theta, AT_LEAST_ZERO)?;
        check_given("--delta", self.delta, AT_LEAST_ZERO)?;
        check_given("--tau", self.tau, ABOVE_ZERO)?;
        check_given("--epsilon", self.epsilon, ABOVE_ZERO)?;
        check("--omega", self.omega, BETWEEN_ZERO_AND_TWO)?;
        let (Stop::Surface(tolerance) | Stop::L2(tolerance)) = self.stop;
        check("--tol", tolerance, ABOVE_ZERO)
    }

    /// The curvature's weight on a grid.
    #[must_use]
    pub fn delta_on(&self, geometry: &Geometry) -> f64 {
        self.delta.unwrap_or(DELTA_VOXELS * geometry.min_spacing())
    }

    /// True unless a stronger curvature was asked for than the default.
    #[must_use]
    pub fn smooths_no_more_than_usual(&self, geometry: &Geometry) -> bool {
        self.delta_on(geometry) <= 1.001 * DELTA_VOXELS * geometry.min_spacing()
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
                speed: false,
            },
            stop: self.stop,
            max_steps: self.max_steps,
            omega: self.omega as f32,
            solver_tolerance: SOLVER_TOLERANCE,
        }
    }
}
