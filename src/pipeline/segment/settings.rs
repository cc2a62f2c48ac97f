//! Settings of `segment`, and what they are when the user gives none. Lengths are physical.

use super::labels::Overlap;
use super::neighbours::FillGaps;
use super::object_report::Refused;
use crate::error::{Error, Result};
use crate::grid::Geometry;
use crate::pipeline::distance::Method;
use crate::pipeline::image::terms::{EdgeSettings, Smoothing};
use crate::pipeline::level_set::motion::Motion;
use crate::pipeline::limits::{ABOVE_ZERO, AT_LEAST_ZERO, check, check_brick, check_given};
use crate::pipeline::marks::ObjectMarks;

/// What the image shows at the border of the objects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageModel {
    /// Found for each object.
    Auto,
    /// Inside and outside differ in brightness.
    Level,
    /// A bright or dark sheet runs along the border.
    Wall,
    /// The papers' edge detector.
    Edge,
    /// Nothing that is to be used.
    None,
}

impl ImageModel {
    /// As it is typed.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Level => "level",
            Self::Wall => "wall",
            Self::Edge => "edge",
            Self::None => "none",
        }
    }
}

/// Where objects start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// As the shape of their outlines; of a loose cloud between its points.
    Auto,
    /// Where a flood from outside ends, as the papers do it.
    Flood,
}

impl Start {
    /// As it is typed.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Flood => "flood",
        }
    }
}

/// What the user may set; `None` leaves a length to the image's spacing.
#[derive(Clone, Debug, PartialEq)]
pub struct SegmentSettings {
    /// Distance method.
    pub method: Method,
    /// What the image shows.
    pub image: ImageModel,
    /// Where objects start.
    pub start: Start,
    /// How the surface moves.
    pub motion: Motion,
    /// Weight of the pull towards the marks; found for each object when none.
    pub theta: Option<f64>,
    /// Weight of the image; found for each object when none.
    pub rho: Option<f64>,
    /// Contrast parameter of the edge detector.
    pub k: f64,
    /// Form of the presmoothing.
    pub smoothing: Smoothing,
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
    /// True to leave out each outline in turn and tell how far its marks then are.
    pub cross_validate: bool,
    /// Edge of the bricks that hold the image.
    pub brick: i64,
}

impl Default for SegmentSettings {
    fn default() -> Self {
        Self {
            method: Method::VDT,
            image: ImageModel::Auto,
            start: Start::Auto,
            motion: Motion::default(),
            theta: None,
            rho: None,
            k: 650.0,
            smoothing: Smoothing::Gaussian,
            sigma: None,
            beta: None,
            caps: true,
            percentiles: [0.1, 99.9],
            overlap: Overlap::Smaller,
            fill_gaps: None,
            cross_validate: false,
            brick: 64,
        }
    }
}

/// Voxels of the smallest spacing that the presmoothing spans by default.
const SIGMA_VOXELS: f64 = 2.0;

impl SegmentSettings {
    /// Refuses numbers with which nothing is found; lengths are held against an image by [`super::check_lengths`].
    ///
    /// # Errors
    /// With the setting and what it may be.
    pub fn check(&self) -> Result<()> {
        check_given("--theta", self.theta, AT_LEAST_ZERO)?;
        check_given("--rho", self.rho, AT_LEAST_ZERO)?;
        self.motion.check()?;
        check("--k", self.k, AT_LEAST_ZERO)?;
        check_given("--sigma", self.sigma, AT_LEAST_ZERO)?;
        check_given("--beta", self.beta, ABOVE_ZERO)?;
        self.check_percentiles()?;
        if let Some(FillGaps::Width(width)) = self.fill_gaps {
            check("--fill-gaps", width, ABOVE_ZERO)?;
        }
        check_brick(self.brick)
    }

    /// The settings as they mean one another: an image that weighs nothing is not looked at, and a beta is where the flood
    /// starts.
    #[must_use]
    pub fn together(&self) -> Self {
        let mut settings = self.clone();
        if settings.rho == Some(0.0) {
            settings.image = ImageModel::None;
        }
        if settings.beta.is_some() {
            settings.start = Start::Flood;
        }
        settings
    }

    fn check_percentiles(&self) -> Result<()> {
        let [low, high] = self.percentiles;
        if 0.0 <= low && low < high && high <= 100.0 {
            return Ok(());
        }
        Err(Error::usage(format!(
            "--percentiles is {low},{high}; give two percentages, the lower one first, such as 0.1,99.9"
        )))
    }

    /// True where the image has a say.
    #[must_use]
    pub fn uses_image(&self) -> bool {
        self.image != ImageModel::None && self.rho != Some(0.0)
    }

    /// The width of the presmoothing on a grid.
    #[must_use]
    pub fn sigma_on(&self, geometry: &Geometry) -> f64 {
        self.sigma.unwrap_or(SIGMA_VOXELS * geometry.min_spacing())
    }

    /// The edge detector for a grid.
    #[must_use]
    pub fn edges(&self, geometry: &Geometry) -> EdgeSettings {
        EdgeSettings { smoothing: self.smoothing, sigma: self.sigma_on(geometry), k: self.k as f32 }
    }
}

/// What guides a segmentation: where the image lies and what was marked on it.
pub struct Guides<'a> {
    /// The grid of the part of the image that is segmented.
    pub geometry: &'a Geometry,
    /// The objects whose marks can be those of the image, as [`super::check_marks`] told, and seeded ones; physical
    /// coordinates.
    pub objects: &'a [ObjectMarks],
    /// The objects whose marks cannot.
    pub refused: &'a [Refused],
}
