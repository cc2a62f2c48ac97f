//! What a segmentation will take: memory that it must hold, scratch, output and a rough time, told before it starts.
//!
//! The cells of every object are counted as the run itself begins with them; the rest follows from the fields that are
//! alive at one time. Everything is an upper bound but for what is called probable, and for objects whose search has to
//! reach farther than its start: how far, only the flood can tell, and it is what the estimate is to be given before.

use super::kept::label_bytes;
use super::neighbours::needs;
use super::outlined::shape_start::BAND;
use super::ranks::parts::Share;
use super::reach::{first_reach, likely_work};
use super::settings::{Guides, SegmentSettings};
use crate::exec::{Comm, Footprint, Plan};
use crate::grid::{Box3, BrickGrid};
use crate::kernel::level_set::cell::{CELL, CELL_LEN};
use crate::pipeline::enclosure::needs::{
    COARSE_VOXELS, DISTANCE_BYTES, KEPT_BYTES, SECONDS_PER_NEAR_VOXEL, SOLVE_BYTES, THREAD_BYTES, box_bytes,
};
use crate::pipeline::enclosure::region::RegionOfInterest;
use crate::pipeline::image::smoothing::thread_bytes;
use crate::pipeline::image::terms::Smoothing;
use crate::pipeline::marks::{ObjectMarks, cloud_of, contour_gap};
use crate::pipeline::output::viewer_mesh;
use crate::store::VolumeSource;

/// What a run is expected to take.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// What must be in memory at one time, beside the window of scratch pages.
    pub footprint: Footprint,
    /// The same on all threads, bytes.
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
    /// Bytes of scratch for the labels where these stay with who asked for them.
    pub labels: u64,
    /// Bytes of the output, if nothing of it could be compressed.
    pub output: u64,
    /// Voxels near the marks, of all objects.
    pub near_voxels: u64,
    /// A rough guess of the seconds it takes.
    pub seconds: f64,
}

impl Estimate {
    /// The same where fields stay with who asked for them; those of objects stay until these are joined in any case.
    #[must_use]
    pub fn keeping(self) -> Self {
        Self { scratch: self.scratch.saturating_add(self.labels), ..self }
    }

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
/// The same to read it, to write it, and to write its label.
const STACK_SECONDS: [f64; 3] = [7e-9, 8e-9, 3e-9];
/// The longest stages of an object, and their shares of its time.
const OBJECT_STAGES: [(&str, f64); 6] =
    [("profiles", 0.03), ("shape", 0.28), ("distance", 0.1), ("speed", 0.08), ("level set", 0.46), ("surface", 0.05)];
/// The same of its mesh for viewers.
const VIEWER_SHARE: f64 = 0.05;

/// Memory that an outline takes: its curve, its edges and where they lie; and what an object's profiles and shape take.
const OUTLINE_BYTES: u64 = 256 << 10;
const OUTLINED_BYTES: u64 = 2 << 20;
/// Memory that a thread takes to count grey values.
const HISTOGRAM_BYTES: u64 = 10 << 20;
/// Memory that a thread takes to fit outlines.
const FIT_BYTES: u64 = 8 << 20;

/// What is kept of each object when it is solved, until all are joined: for a cell of its box, stored or not, its slot and the
/// values of both fields where they are not stored; for a stored one its number and the locks of both fields and their faces.
const KEPT_GRID_CELL_BYTES: u64 = 12;
const KEPT_CELL_BYTES: u64 = 64;

/// What an outline and an object's profiles take for each point of its cloud where that is less than the above.
const OUTLINED_POINT_BYTES: u64 = 512;

/// What there is of all objects: cells near their marks, points, outlines.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    /// The most of one object's points.
    points: u64,
    /// The most of one object's cells, stored or not, and those of all.
    grid_cells: u64,
    all_grid_cells: u64,
    /// The most of one object's cells that its search begins with.
    largest: u64,
    /// Such cells of all objects.
    near: u64,
    /// Cells of bands, probably: the most of one object, and those of all.
    bands: [u64; 2],
    /// Bytes of the bricks of labels that objects can lie in.
    labels: u64,
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
                counts.labels = label_bytes(guides.geometry, &guides.geometry.domain());
                continue;
            }
            let cloud = cloud_of(marks, guides.geometry, settings.caps);
            let region = RegionOfInterest::new(guides.geometry, &cloud, first_reach(marks, guides.geometry, settings));
            let first = region.cells.len() as u64;
            counts.add(region.cells.grid().len(), [first, likely_band(&region, marks).min(first)]);
            counts.points = counts.points.max(cloud.len() as u64);
            counts.labels += label_bytes(guides.geometry, &region.window);
            let most = marks.contours.len() as u64 * OUTLINE_BYTES + OUTLINED_BYTES;
            counts.outlines[0] += most;
            counts.outlines[1] += most.min(cloud.len() as u64 * OUTLINED_POINT_BYTES);
        }
        counts.labels = counts.labels.min(label_bytes(guides.geometry, &guides.geometry.domain()));
        counts
    }

    /// Adds an object with so many cells, of which its search begins with some, and its band probably has some.
    fn add(&mut self, grid_cells: u64, [first, band]: [u64; 2]) {
        self.grid_cells = self.grid_cells.max(grid_cells);
        self.all_grid_cells += grid_cells;
        (self.largest, self.near) = (self.largest.max(first), self.near + first);
        self.bands = [self.bands[0].max(band), self.bands[1] + band];
    }
}

/// Cells that the band of an object probably has, around the cells that its cloud lies in: a surface goes through a cell in
/// any direction where it passes within half of the cell's mean width, which is 3/2 of its edge (Cauchy), and a band that
/// reaches `r` to either side meets cells that lie so much farther away. Where outlines are farther apart than a cell is
/// wide, cells between them hold no point.
fn likely_band(region: &RegionOfInterest, marks: &ObjectMarks) -> u64 {
    let (geometry, grid) = (&region.geometry, region.bins.grid());
    let held = (0..grid.len()).filter(|&id| !region.bins.of(id).is_empty()).count() as f64;
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
    let counts = Counts::new(guides, settings);
    let Counts { points, grid_cells, largest, near, bands, outlines, .. } = counts;
    let voxels = crop.volume();
    let grid = BrickGrid::new(crop.shape(), settings.brick);
    let image = grid.len() * grid.brick_len() as u64 * size;
    let (largest_voxels, near_voxels) = (largest * CELL_LEN as u64, near * CELL_LEN as u64);
    let decoders = decoded(stack);
    let buffers = smoothing(guides, settings, size);
    let (joining, joined) = joining(guides, settings, threads);
    let footprint = footprint(stack, &counts, [buffers, joining], threads, writes);
    let coarse = if writes { voxels * size * 3 / 4 } else { 0 };
    let cells = box_bytes(points, grid_cells, largest);
    Estimate {
        footprint,
        held: footprint.bytes(threads),
        working: PROGRAM_BYTES + outlines[1] + cells + decoders.and(buffers).bytes(threads),
        fields: image + (SOLVE_BYTES * bands[0] + KEPT_BYTES * bands[1]) * CELL_LEN as u64,
        scratch: image + (SOLVE_BYTES * largest_voxels).max(coarse).max(joined) + KEPT_BYTES * near_voxels,
        labels: counts.labels,
        least_scratch: image + DISTANCE_BYTES * largest_voxels,
        output: if writes { voxels * (size + 1) * 3 / 2 + 5 * near_voxels } else { 0 },
        near_voxels,
        seconds: (near_voxels as f64 * SECONDS_PER_NEAR_VOXEL + voxels as f64 * SECONDS_PER_VOXEL) / threads as f64,
    }
}

/// The stages of a segmentation on this rank, and what each will probably take.
#[must_use]
pub fn plan(
    estimate: &Estimate,
    guides: &Guides<'_>,
    comm: &dyn Comm,
    (voxels, threads, writes): (u64, usize, bool),
) -> Plan {
    let all = voxels as f64 / threads as f64;
    let mut plan = vec![("read stack".to_owned(), all * STACK_SECONDS[0])];
    if writes {
        plan.extend([("write image".into(), all * STACK_SECONDS[1]), ("write labels".into(), all * STACK_SECONDS[2])]);
    }
    let surfaces: Vec<f64> = guides.objects.iter().map(|marks| likely_work(marks, guides.geometry)).collect();
    let near = estimate.near_voxels as f64 * SECONDS_PER_NEAR_VOXEL / threads as f64 / surfaces.iter().sum::<f64>();
    for n in Share::of(comm, guides.objects, guides.geometry).all() {
        let (marks, surface) = (&guides.objects[n], surfaces[n]);
        let stages = OBJECT_STAGES.iter();
        plan.extend(stages.map(|(name, share)| (format!("{name} {}", marks.object), near * surface * share)));
        plan.extend(writes.then(|| (viewer_mesh::STAGE.to_owned(), near * surface * VIEWER_SHARE)));
    }
    plan
}

/// What is in memory at one time: while the image comes in; then, decoders keeping their buffers, while objects are solved,
/// fields written, or neighbours joined.
fn footprint(
    stack: &dyn VolumeSource,
    counts: &Counts,
    [buffers, joining]: [Footprint; 2],
    threads: u64,
    writes: bool,
) -> Footprint {
    let size = stack.element().size() as u64;
    let decoders = decoded(stack);
    let reading = decoders.and(Footprint::of_thread(stack.decoding_bytes() + HISTOGRAM_BYTES));
    let boxes = Footprint::of_boxes(box_bytes(counts.points, counts.grid_cells, counts.largest));
    let outlines = Footprint::of_all(counts.outlines[0]).and(Footprint::of_thread(FIT_BYTES));
    let solving = boxes.and(outlines).and(buffers);
    let writing = Footprint::of_thread(if writes { COARSE_VOXELS * size.max(4) } else { 0 });
    let kept = Footprint::of_all(counts.all_grid_cells * KEPT_GRID_CELL_BYTES + counts.near * KEPT_CELL_BYTES);
    let later = solving.or(writing, threads).or(joining, threads);
    reading.or(decoders.and(kept).and(later), threads)
}

/// A box as it is stored, decoded, of each thread.
fn decoded(stack: &dyn VolumeSource) -> Footprint {
    let natural = Box3::from_shape(stack.natural_shape()).volume();
    Footprint::of_thread(natural.saturating_mul(stack.element().size() as u64))
}

/// Buffers of a thread for cells, and to smooth the image where that takes more.
fn smoothing(guides: &Guides<'_>, settings: &SegmentSettings, sample: u64) -> Footprint {
    let smooths = settings.smoothing == Smoothing::Gaussian && settings.uses_image();
    let sigma = [settings.sigma_on(guides.geometry); 3];
    let bytes = if smooths { thread_bytes(guides.geometry.spacing, sigma, sample) } else { 0 };
    Footprint::of_thread(THREAD_BYTES.max(bytes))
}

/// What joining several objects takes, of memory and of scratch.
fn joining(guides: &Guides<'_>, settings: &SegmentSettings, threads: u64) -> (Footprint, u64) {
    if guides.objects.len() > 1 {
        needs(guides.geometry, settings.fill_gaps, threads)
    } else {
        (Footprint::default(), 0)
    }
}
