//! Settings of `reconstruct`, and what they are when the user gives none. Lengths are physical.

use crate::pipeline::distance::Method;
use crate::pipeline::motion::Motion;

/// What the user may set.
#[derive(Clone, Debug, PartialEq)]
pub struct ReconstructSettings {
    /// Distance method.
    pub method: Method,
    /// How the surface moves.
    pub motion: Motion,
    /// Distance of the start surface from the cloud; automatic when none.
    pub beta: Option<f64>,
}

impl Default for ReconstructSettings {
    fn default() -> Self {
        Self { method: Method::VDT, motion: Motion { rho: 0.0, ..Motion::default() }, beta: None }
    }
}
