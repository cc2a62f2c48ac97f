//! How far an object reaches around its marks: where the search for what they enclose begins, where it probably lies, and what it
//! probably takes.

use super::settings::SegmentSettings;
use crate::grid::{Box3, Geometry};
use crate::pipeline::enclosure::region::voxel_bounds;
use crate::pipeline::enclosure::search::first_reach_for;
use crate::pipeline::marks::{ObjectMarks, contour_gap};

/// Of the gap between contours.
const FIRST_REACH_GAPS: f64 = 1.5;

/// The distance from the cloud within which the search begins, a physical length.
pub(super) fn first_reach(marks: &ObjectMarks, image: &Geometry, settings: &SegmentSettings) -> f64 {
    first_reach_for(image, settings.beta).max(FIRST_REACH_GAPS * contour_gap(marks, image))
}

/// Voxels that an object reaches farther than half of its extents.
const MARGIN: i64 = 8;

/// The voxels that an object probably has: around its marks half of their extents more; of a seed any.
pub(super) fn likely_box(marks: &ObjectMarks, geometry: &Geometry) -> Box3 {
    if marks.seed.is_some() {
        return geometry.domain();
    }
    let bounds = voxel_bounds(&marks.contours.concat(), geometry);
    let farther = bounds.shape().map(|n| n / 2 + MARGIN);
    Box3::new(std::array::from_fn(|a| bounds.lo[a] - farther[a]), std::array::from_fn(|a| bounds.hi[a] + farther[a]))
}

/// What an object takes, compared with others: its band goes with its surface, and that with its extents squared.
pub(super) fn likely_work(marks: &ObjectMarks, geometry: &Geometry) -> f64 {
    let part = match marks.seed {
        Some(_) => geometry.domain(),
        None => voxel_bounds(&marks.contours.concat(), geometry),
    };
    libm::pow(part.volume().max(1) as f64, 2.0 / 3.0)
}
