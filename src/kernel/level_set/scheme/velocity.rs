//! What moves the surface, and the fields of a cell that it is computed from.

/// What moves the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Velocity {
    /// Weight of the attraction to the points, `-grad d`.
    pub theta: f32,
    /// Weight of the attraction to the image's edges, `-grad g`.
    pub rho: f32,
    /// Weight of the curvature, a length.
    pub delta: f32,
    /// Regularisation of gradient norms, in units of one over length.
    pub epsilon: f32,
    /// Length of the time step.
    pub tau: f32,
    /// True when the edge term is divided by the norm of grad g.
    pub normalised: bool,
    /// True when what the image gives is a speed along the outward normal, not an edge detector.
    pub speed: bool,
}

/// The fields of one grown cell. The edge detector may be empty when `rho` is 0.
#[derive(Clone, Copy, Debug)]
pub struct Fields<'a> {
    /// Segmentation function at the old time step.
    pub u: &'a [f32],
    /// Distance to the cloud, physical.
    pub d: &'a [f32],
    /// Edge detector, or speed along the outward normal.
    pub g: &'a [f32],
}
