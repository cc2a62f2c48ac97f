//! Where an object is solved: the box around its cloud and the cells near it, for the run and for its estimate alike.

use super::settings::SegmentSettings;
use crate::grid::{Box3, BrickGrid, BrickSet, Geometry, PointBins};
use crate::kernel::level_set::CELL;
use crate::pipeline::marks::{ObjectMarks, contour_gap};

/// Distances that the search for a closed cloud starts with, in largest spacings and in gaps between contours.
const FIRST_REACH_VOXELS: f64 = 6.0;
const FIRST_REACH_GAPS: f64 = 1.5;

/// The distance from the cloud within which the search begins, a physical length.
pub(super) fn first_reach(marks: &ObjectMarks, image: &Geometry, settings: &SegmentSettings) -> f64 {
    let wanted = settings.beta.map_or(0.0, |beta| 2.0 * beta);
    (FIRST_REACH_VOXELS * image.max_spacing())
        .max(FIRST_REACH_GAPS * contour_gap(marks, image))
        .max(wanted + 2.0 * image.max_spacing())
}

/// The grid around a cloud, and its cells within a distance of it.
pub(super) struct Vicinity {
    /// The grid of the box.
    pub geometry: Geometry,
    /// The box in voxels of the image; may reach past it.
    pub window: Box3,
    /// The points by cell.
    pub bins: PointBins,
    /// The cells within the distance.
    pub cells: BrickSet,
}

impl Vicinity {
    /// What lies within `farthest` (physical) of `cloud`.
    pub(super) fn new(image: &Geometry, cloud: &[[f64; 3]], farthest: f64) -> Self {
        let (geometry, window) = grid_around(image, &voxel_bounds(cloud, image), farthest);
        let bins = PointBins::new(BrickGrid::new(geometry.shape, CELL as i64), &geometry, cloud);
        let reach = geometry.spacing.map(|h| (farthest / h).ceil() as i64 + 1);
        let cells = bins.bricks_within(&geometry, cloud, reach);
        Self { geometry, window, bins, cells }
    }
}

/// The voxels of the image grid that hold the cloud; may reach past the image.
pub(super) fn voxel_bounds(cloud: &[[f64; 3]], image: &Geometry) -> Box3 {
    let mut voxels = cloud.iter().map(|&p| image.to_voxels(p));
    let first = voxels.next().unwrap_or_default();
    let (lo, hi) = voxels.fold((first, first), |(lo, hi), v| {
        (std::array::from_fn(|a| lo[a].min(v[a])), std::array::from_fn(|a| hi[a].max(v[a])))
    });
    Box3::new(lo.map(|v| v.floor() as i64), hi.map(|v| v.ceil() as i64 + 1))
}

/// The object's box: its cloud and a margin, starting at a whole cell of the image's grid.
fn grid_around(image: &Geometry, bounds: &Box3, farthest: f64) -> (Geometry, Box3) {
    let cell = CELL as i64;
    let margin: [i64; 3] = image.spacing.map(|h| (farthest / h).ceil() as i64 + 2);
    let window = Box3 {
        lo: std::array::from_fn(|a| (bounds.lo[a] - margin[a]).div_euclid(cell) * cell),
        hi: std::array::from_fn(|a| bounds.hi[a] + margin[a]),
    };
    (image.crop(&window), window)
}
