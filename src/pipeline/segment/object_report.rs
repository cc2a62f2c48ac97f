//! What is told of an object when it is solved, or why it was not.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use crate::kernel::surface::{Hausdorff, Measures, Spread};
use crate::pipeline::enclosure::search::Hole;
use crate::pipeline::level_set::time_loop::Evolution;
use crate::pipeline::output::viewer_mesh::Simplified;

/// What is reported of a solved object.
#[derive(Clone, Debug, Serialize, Deserialize)]
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
    /// How many marks are how far from the surface.
    pub spread: Option<Spread>,
    /// Marks that are farther from it than the largest spacing.
    pub marks_off: u64,
    /// What was taken from the image: `level`, `wall`, `edge`, `none`.
    pub image_model: Cow<'static, str>,
    /// Weight of the pull towards the marks.
    pub theta: f64,
    /// Weight of the image.
    pub rho: f64,
    /// How far outlines that are left out lie from the shape of the others, where that was asked for.
    pub cross_validation: Option<CrossValidation>,
    /// The copy of a large surface that its store has for viewers.
    pub simplified: Option<Simplified>,
}

/// What leaving out each outline in turn tells.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CrossValidation {
    /// Mean distance of the marks that were left out.
    pub mean: f64,
    /// Nine of ten are nearer than this.
    pub p90: f64,
    /// Where the next outline would help most: the axis that its slice is across, and the slice.
    pub next_slice: Option<(usize, i64)>,
}

/// An object that could not be solved.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Refused {
    /// Its number.
    pub label: u32,
    /// Why, in one sentence.
    pub reason: String,
}
