//! What a segmentation will take: memory that it must hold, scratch, output and a rough time, told before it starts.
//!
//! The cells of every object are counted as the run itself begins with them; the rest follows from the fields that are
//! alive at one time. Everything is an upper bound but for what is called probable, and for objects whose search has to
//! reach farther than its start: how far, only the flood can tell, and it is what the estimate is to be given before.

use super::neighbours::needs;
use super::outlined::shape_start::BAND;
use super::reach::first_reach;
use super::settings::{Guides, SegmentSettings};
use crate::grid::{Box3, BrickGrid};
use crate::kernel::level_set::cell::{CELL, CELL_LEN};
use crate::pipeline::enclosure::needs::{
    COARSE_VOXELS, DISTANCE_BYTES, GRID_CELL_BYTES, KEPT_BYTES, POINT_BYTES, SECONDS_PER_NEAR_VOXEL, SOLVE_BYTES,
    STORED_CELL_BYTES, THREAD_BYTES,
};
use crate::pipeline::enclosure::region::Vicinity;
use crate::pipeline::image::smoothing::thread_bytes;
use crate::pipeline::image::terms::Smoothing;
use crate::pipeline::marks::{ObjectMarks, cloud_of, contour_gap};
use crate::store::VolumeSource;

/// What a run is expected to take.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Bytes that must be in memory at one time, beside the window of scratch pages.
    pub held: u64,
    /// Bytes of memory that are probably in use at one time beside fields, the program itself included.
    pub working: u64,
    /// Bytes of fields that are probably there at one time.
    pub fields: u64,
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

impl Estimate {
    /// Bytes of memory that are probably in use at one time where fields have a window of so many.
    #[must_use]
    pub fn resident(&self, window: u64) -> u64 {
        self.working + self.fields.min(window)
    }
}

/// The program itself when it runs: its code, its tables, the stacks of its threads.
const PROGRAM_BYTES: u64 = 12 << 20;
/// Seconds of one thread for a voxel of the image.
const SECONDS_PER_VOXEL: f64 = 6e-8;

/// Memory that an outline takes: its curve, its edges and where they lie; and what an object's profiles and shape take.
const OUTLINE_BYTES: u64 = 256 << 10;
const OUTLINED_BYTES: u64 = 2 << 20;
/// Memory that a thread takes to count grey values.
const HISTOGRAM_BYTES: u64 = 10 << 20;
/// Memory that a thread takes to fit outlines.
const FIT_BYTES: u64 = 8 << 20;

/// What an outline and an object's profiles take for each point of its cloud where that is less than the above.
const OUTLINED_POINT_BYTES: u64 = 512;

/// What there is of all objects: cells near their marks, points, outlines.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    /// The most of one object's points.
    points: u64,
    /// The most of one object's cells, stored or not.
    grid_cells: u64,
    /// The most of one object's cells that its search begins with.
    largest: u64,
    /// Such cells of all objects.
    near: u64,
    /// Cells of bands, probably: the most of one object, and those of all.
    bands: [u64; 2],
    /// Bytes of all outlines at the most, and probably.
    outlines: [u64; 2],
}

impl Counts {
    /// Counts the cells of every object.
    fn new(guides: &Guides<'_>, settings: &SegmentSettings) -> Self {
        let mut counts = Self::default();
        for marks in guides.objects {
            if marks.seed.is_some() {
                // Without marks the surface may go anywhere.
                let all = BrickGrid::new(guides.geometry.shape, CELL as i64).len();
                counts.add(all, [all; 2]);
                continue;
            }
            let cloud = cloud_of(marks, guides.geometry, settings.caps);
            let vicinity = Vicinity::new(guides.geometry, &cloud, first_reach(marks, guides.geometry, settings));
            let first = vicinity.cells.len() as u64;
            counts.add(vicinity.cells.grid().len(), [first, likely_band(&vicinity, marks).min(first)]);
            counts.points = counts.points.max(cloud.len() as u64);
            let most = marks.contours.len() as u64 * OUTLINE_BYTES + OUTLINED_BYTES;
            counts.outlines[0] += most;
            counts.outlines[1] += most.min(cloud.len() as u64 * OUTLINED_POINT_BYTES);
        }
        counts
    }

    /// Adds an object with so many cells, of which its search begins with some, and its band probably has some.
    fn add(&mut self, grid_cells: u64, [first, band]: [u64; 2]) {
        self.grid_cells = self.grid_cells.max(grid_cells);
        (self.largest, self.near) = (self.largest.max(first), self.near + first);
        self.bands = [self.bands[0].max(band), self.bands[1] + band];
    }
}

/// Cells that the band of an object probably has, around the cells that its cloud lies in: a surface goes through a cell in
/// any direction where it passes within half of the cell's mean width, which is 3/2 of its edge (Cauchy), and a band that
/// reaches `r` to either side meets cells that lie so much farther away. Where outlines are farther apart than a cell is
/// wide, cells between them hold no point.
fn likely_band(vicinity: &Vicinity, marks: &ObjectMarks) -> u64 {
    let (geometry, grid) = (&vicinity.geometry, vicinity.bins.grid());
    let held = (0..grid.len()).filter(|&id| !vicinity.bins.of(id).is_empty()).count() as f64;
    let mean_spacing = libm::cbrt(geometry.voxel_volume());
    let edge = CELL as f64 * mean_spacing;
    let thickness = 1.0 + 2.0 * BAND[0] * geometry.min_spacing() / (1.5 * edge);
    (held * thickness * (contour_gap(marks, geometry) / edge).max(1.0)) as u64
}

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
    let Counts { points, grid_cells, largest, near, bands, outlines } = Counts::new(guides, settings);
    let voxels = crop.volume();
    let grid = BrickGrid::new(crop.shape(), settings.brick);
    let image = grid.len() * grid.brick_len() as u64 * size;
    let (largest_voxels, near_voxels) = (largest * CELL_LEN as u64, near * CELL_LEN as u64);
    // While the image comes in: a natural box, what its decoding takes, and a histogram.
    let reading = threads * (natural + stack.decoding_bytes() + HISTOGRAM_BYTES);
    let cells = points * POINT_BYTES + grid_cells * GRID_CELL_BYTES + largest * STORED_CELL_BYTES;
    let solving = outlines[0] + threads * FIT_BYTES + cells;
    let writing = if writes { threads * COARSE_VOXELS * size.max(4) } else { 0 };
    // Decoders keep their buffers.
    let decoders = threads * natural;
    let [joining, joined] =
        if guides.objects.len() > 1 { needs(guides.geometry, settings.fill_gaps, threads) } else { [0; 2] };
    let coarse = if writes { voxels * size * 3 / 4 } else { 0 };
    let buffers = if settings.smoothing == Smoothing::Gaussian && settings.uses_image() {
        THREAD_BYTES.max(thread_bytes(guides.geometry.spacing, [settings.sigma_on(guides.geometry); 3], size))
    } else {
        THREAD_BYTES
    };
    Estimate {
        held: reading.max(decoders + (solving + threads * buffers).max(writing).max(joining)),
        working: PROGRAM_BYTES + decoders + outlines[1] + cells + threads * buffers,
        fields: image + (SOLVE_BYTES * bands[0] + KEPT_BYTES * bands[1]) * CELL_LEN as u64,
        scratch: image + (SOLVE_BYTES * largest_voxels).max(coarse).max(joined) + KEPT_BYTES * near_voxels,
        least_scratch: image + DISTANCE_BYTES * largest_voxels,
        output: if writes { voxels * (size + 1) * 3 / 2 + 5 * near_voxels } else { 0 },
        near_voxels,
        seconds: (near_voxels as f64 * SECONDS_PER_NEAR_VOXEL + voxels as f64 * SECONDS_PER_VOXEL) / threads as f64,
    }
}
