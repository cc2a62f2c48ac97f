//! Settings of `reconstruct`, and what they are when the user gives none. Lengths are physical.

use crate::error::Result;
use crate::grid::Geometry;
use crate::pipeline::distance::Method;
use crate::pipeline::level_set::motion::Motion;
use crate::pipeline::level_set::time_loop::Stop;
use crate::pipeline::limits::{ABOVE_ZERO, AT_LEAST_ZERO, check_given};

/// Where the vertices of the mesh lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Vertices {
    /// Where the points near them have the surface, at most a part of a voxel from where the level set has it.
    Points,
    /// Where the level set crosses 1/2 between two voxels.
    LevelSet,
}

impl Vertices {
    /// As it is typed.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Points => "points",
            Self::LevelSet => "level-set",
        }
    }
}

/// What the user may set.
#[derive(Clone, Debug, PartialEq)]
pub struct ReconstructSettings {
    /// Distance method.
    pub method: Method,
    /// How the surface moves.
    pub motion: Motion,
    /// Distance of the start surface from the cloud; automatic when none.
    pub beta: Option<f64>,
    /// The standard deviation of the points from the surface, 0 to take all as they are; found when none.
    pub noise: Option<f64>,
    /// Whether the surface ends where the points do; else it is closed.
    pub open: bool,
    /// Where the mesh has its vertices; where none, at the points unless a surface is asked for that leaves these.
    pub vertices: Option<Vertices>,
    /// Whether handles, tunnels and pieces of a few spacings are left as they are.
    pub keeps_topology: bool,
    /// Whether fields are written on the grid as it was given; else on a box of it around what is found.
    pub keeps_grid: bool,
}

/// The start is near the surface: it is worth the few steps more to let it come to rest.
const REST: Stop = Stop::Surface(0.005);

impl Default for ReconstructSettings {
    fn default() -> Self {
        Self {
            method: Method::VDT,
            motion: Motion { rho: 0.0, stop: REST, ..Motion::default() },
            beta: None,
            noise: None,
            open: false,
            vertices: None,
            keeps_topology: false,
            keeps_grid: false,
        }
    }
}

impl ReconstructSettings {
    /// Where the mesh has its vertices: a surface that is drawn to the points less than usual, or smoothed more, leaves them because it
    /// shall.
    #[must_use]
    pub fn vertices_on(&self, geometry: &Geometry) -> Vertices {
        let follows = self.motion.theta >= Motion::default().theta && self.motion.smooths_no_more_than_usual(geometry);
        self.vertices.unwrap_or(if follows { Vertices::Points } else { Vertices::LevelSet })
    }

    /// Refuses numbers that no surface can start from, or move by.
    ///
    /// # Errors
    /// With the setting and what it may be.
    pub fn check(&self) -> Result<()> {
        self.motion.check()?;
        check_given("--beta", self.beta, ABOVE_ZERO)?;
        check_given("--noise", self.noise, AT_LEAST_ZERO)
    }
}
