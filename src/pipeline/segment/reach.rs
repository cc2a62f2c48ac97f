//! How far around an object's marks the search for what they enclose begins.

use super::settings::SegmentSettings;
use crate::grid::Geometry;
use crate::pipeline::enclosure::search::first_reach_for;
use crate::pipeline::marks::{ObjectMarks, contour_gap};

/// Of the gap between contours.
const FIRST_REACH_GAPS: f64 = 1.5;

/// The distance from the cloud within which the search begins, a physical length.
pub(super) fn first_reach(marks: &ObjectMarks, image: &Geometry, settings: &SegmentSettings) -> f64 {
    first_reach_for(image, settings.beta).max(FIRST_REACH_GAPS * contour_gap(marks, image))
}
