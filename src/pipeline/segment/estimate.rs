//! What a segmentation will take: memory that it must hold, scratch, output and a rough time, told before it starts.
//!
//! The cells of every object are counted as the run itself begins with them; the rest follows from the fields that are
//! alive at one time. Everything is an upper bound but for objects whose search has to reach farther than its start:
//! how far, only the flood can tell, and it is what the estimate is to be given before.

use super::neighbours::needs;
use super::reach::first_reach;
use super::settings::{Guides, SegmentSettings};
use crate::grid::{Box3, BrickGrid};
use crate::kernel::level_set::{CELL, CELL_LEN};
use crate::pipeline::cell_needs::{
    COARSE_VOXELS, DISTANCE_BYTES, GRID_CELL_BYTES, KEPT_BYTES, POINT_BYTES, SECONDS_PER_NEAR_VOXEL, SOLVE_BYTES,
    STORED_CELL_BYTES, THREAD_BYTES,
};
use crate::pipeline::image_terms::Smoothing;
use crate::pipeline::marks::{cloud_of, split_and_seed};
use crate::pipeline::smoothing::thread_bytes;
use crate::pipeline::vicinity::Vicinity;
use crate::store::VolumeSource;

/// What a run is expected to take.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Bytes that must be in memory at one time, beside the window of scratch pages.
    pub held: u64,
    /// Bytes of scratch at one time, for objects that are closed within the first reach of their search; one whose
    /// cloud has wider holes is solved among more cells and takes more.
    pub scratch: u64,
    /// Bytes of scratch without which the run cannot even start to solve.
    pub least_scratch: u64,
    /// Bytes of the output, if nothing of it could be compressed.
    pub output: u64,
    /// Voxels near the marks, of all objects.
    pub near_voxels: u64,
    /// A rough guess of the seconds it takes.
    pub seconds: f64,
}

/// Seconds of one thread for a voxel of the image.
const SECONDS_PER_VOXEL: f64 = 6e-8;

/// Memory that an outline takes: its curve, its edges and where they lie; and what an object's profiles and shape take.
const OUTLINE_BYTES: u64 = 256 << 10;
const OUTLINED_BYTES: u64 = 2 << 20;
/// Memory that a thread takes to count grey values.
const HISTOGRAM_BYTES: u64 = 10 << 20;
/// Memory that a thread takes to fit outlines.
const FIT_BYTES: u64 = 8 << 20;

/// Estimates the segmentation of `crop` with `threads` threads; `writes` says whether there is an output.
///
/// The search for what a cloud encloses is taken to end where it begins, at its first reach.
#[must_use]
pub fn estimate(
    stack: &dyn VolumeSource,
    crop: &Box3,
    guides: &Guides<'_>,
    settings: &SegmentSettings,
    threads: u64,
    writes: bool,
) -> Estimate {
    let size = stack.element().size() as u64;
    let natural = Box3::from_shape(stack.natural_shape()).volume() * size;
    let (mut points, mut grid_cells, mut largest, mut near, mut outlines) = (0, 0, 0, 0, 0);
    let objects = split_and_seed(guides.cloud, guides.seeds);
    for marks in &objects {
        if marks.seed.is_some() {
            // Without marks the surface may go anywhere.
            let all = BrickGrid::new(guides.geometry.shape, CELL as i64).len();
            (grid_cells, largest, near) = (grid_cells.max(all), largest.max(all), near + all);
            continue;
        }
        let cloud = cloud_of(marks, guides.geometry, settings.caps);
        let reach = first_reach(marks, guides.geometry, settings);
        let cells = Vicinity::new(guides.geometry, &cloud, reach).cells;
        points = points.max(cloud.len() as u64);
        grid_cells = grid_cells.max(cells.grid().len());
        largest = largest.max(cells.len() as u64);
        near += cells.len() as u64;
        outlines += marks.contours.len() as u64 * OUTLINE_BYTES + OUTLINED_BYTES;
    }
    let voxels = crop.volume();
    let grid = BrickGrid::new(crop.shape(), settings.brick);
    let image = grid.len() * grid.brick_len() as u64 * size;
    let (largest_voxels, near_voxels) = (largest * CELL_LEN as u64, near * CELL_LEN as u64);
    // While the image comes in: a natural box, what its decoding takes, and a histogram.
    let reading = threads * (natural + stack.decoding_bytes() + HISTOGRAM_BYTES);
    let solving = outlines
        + threads * FIT_BYTES
        + points * POINT_BYTES
        + grid_cells * GRID_CELL_BYTES
        + largest * STORED_CELL_BYTES;
    let writing = if writes { threads * COARSE_VOXELS * size.max(4) } else { 0 };
    // Decoders keep their buffers.
    let decoders = threads * natural;
    let [joining, joined] =
        if objects.len() > 1 { needs(guides.geometry, settings.fill_gaps, threads) } else { [0; 2] };
    let coarse = if writes { voxels * size * 3 / 4 } else { 0 };
    let buffers = if settings.smoothing == Smoothing::Gaussian && settings.uses_image() {
        THREAD_BYTES.max(thread_bytes(guides.geometry.spacing, [settings.sigma_on(guides.geometry); 3], size))
    } else {
        THREAD_BYTES
    };
    Estimate {
        held: reading.max(decoders + (solving + threads * buffers).max(writing).max(joining)),
        scratch: image + (SOLVE_BYTES * largest_voxels).max(coarse).max(joined) + KEPT_BYTES * near_voxels,
        least_scratch: image + DISTANCE_BYTES * largest_voxels,
        output: if writes { voxels * (size + 1) * 3 / 2 + 5 * near_voxels } else { 0 },
        near_voxels,
        seconds: (near_voxels as f64 * SECONDS_PER_NEAR_VOXEL + voxels as f64 * SECONDS_PER_VOXEL) / threads as f64,
    }
}
