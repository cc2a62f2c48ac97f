//! Settings of `segment`, and what they are when the user gives none. Lengths are physical.

use super::labels::Overlap;
use super::neighbours::FillGaps;
use crate::grid::{Geometry, PointCloud};
use crate::pipeline::distance::Method;
use crate::pipeline::image_terms::EdgeSettings;
use crate::pipeline::marks::Seed;
use crate::pipeline::motion::Motion;

/// What the user may set; `None` leaves a length to the image's spacing.
#[derive(Clone, Debug, PartialEq)]
pub struct SegmentSettings {
    /// Distance method.
    pub method: Method,
    /// How the surface moves.
    pub motion: Motion,
    /// Contrast parameter of the edge detector.
    pub k: f64,
    /// Width of the presmoothing, a length.
    pub sigma: Option<f64>,
    /// Distance of the start surface from the cloud; automatic when none.
    pub beta: Option<f64>,
    /// True to cap the ends of contour stacks.
    pub caps: bool,
    /// Percentages of the image's values taken as black and white.
    pub percentiles: [f64; 2],
    /// Which object a voxel belongs to where several overlap.
    pub overlap: Overlap,
    /// How wide a gap between objects is filled; none leaves them.
    pub fill_gaps: Option<FillGaps>,
    /// Edge of the bricks that hold the image.
    pub brick: i64,
}

impl Default for SegmentSettings {
    fn default() -> Self {
        Self {
            method: Method::VDT,
            motion: Motion::default(),
            k: 650.0,
            sigma: None,
            beta: None,
            caps: true,
            percentiles: [0.1, 99.9],
            overlap: Overlap::Smaller,
            fill_gaps: None,
            brick: 64,
        }
    }
}

/// Voxels of the smallest spacing that the presmoothing spans by default.
const SIGMA_VOXELS: f64 = 2.0;

impl SegmentSettings {
    /// The width of the presmoothing on a grid.
    #[must_use]
    pub fn sigma_on(&self, geometry: &Geometry) -> f64 {
        self.sigma.unwrap_or(SIGMA_VOXELS * geometry.min_spacing())
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
    /// Balls that further objects start as, which no marks guide.
    pub seeds: &'a [Seed],
}
