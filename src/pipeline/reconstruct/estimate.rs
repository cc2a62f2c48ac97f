//! What a reconstruction will take, told before it starts: that of its cells as the search begins with them.

use super::settings::ReconstructSettings;
use crate::error::{Error, Result};
use crate::exec::{Footprint, Plan};
use crate::grid::digits::{bytes, grouped};
use crate::grid::{BrickGrid, Geometry};
use crate::kernel::level_set::cell::{CELL, CELL_LEN};
use crate::pipeline::enclosure::needs::{COARSE_VOXELS, DISTANCE_BYTES, GRID_CELL_BYTES, THREAD_BYTES};
use crate::pipeline::enclosure::region::RegionOfInterest;
use crate::pipeline::enclosure::search::first_reach_for;
use crate::pipeline::laying::check_counts;
use crate::pipeline::output::viewer_mesh;
use crate::pipeline::topology::topology_bytes;

/// What a run is expected to take; of a cloud whose holes are wider than the search's first reach it takes more.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Bytes that must be in memory at one time, beside the window of scratch pages.
    pub held: u64,
    /// Bytes of scratch at one time.
    pub scratch: u64,
    /// Bytes of scratch without which the run cannot even start to solve.
    pub least_scratch: u64,
    /// Bytes of the output, if nothing of it could be compressed.
    pub output: u64,
    /// Voxels near the cloud.
    pub near_voxels: u64,
    /// A rough guess of the seconds it takes.
    pub seconds: f64,
}

/// Scratch a voxel near the cloud takes while its side is told: distance and region with faces, and the side. The band
/// is solved among fewer cells and takes less.
const SIDES_BYTES: u64 = 13;
/// Seconds of one thread for a voxel near the cloud, that of a second search within twice the reach included.
const SECONDS_PER_NEAR_VOXEL: f64 = 6e-7;

/// Bytes of a point while the spacing of all is told: it and its copies in order, its distance, its node of a tree, and
/// where copies are thinned out its place in a table.
const SPACING_BYTES: u64 = 320;

/// Bytes of memory that so many points take while their spacing is told.
#[must_use]
pub fn spacing_memory(points: usize) -> u64 {
    points as u64 * SPACING_BYTES
}

/// Bytes of memory that a grid takes for its cells alone, told without taking any.
fn least_memory(grid: &Geometry) -> u64 {
    BrickGrid::new(grid.shape, CELL as i64).len().saturating_mul(GRID_CELL_BYTES)
}

/// Refuses a grid whose cells alone would not fit the memory, before any is taken for them.
///
/// # Errors
/// With the memory that it takes, or the number of voxels where there are more than can be counted.
pub fn refuse_too_fine(grid: &Geometry, memory: u64) -> Result<()> {
    check_counts(grid.shape.map(|n| n as f64))?;
    let least = least_memory(grid);
    if least <= memory {
        return Ok(());
    }
    Err(Error::usage(format!(
        "a grid of {} voxels needs {} of memory for its cells alone, but {} are allowed; give a larger --spacing",
        grouped(grid.domain().volume()),
        bytes(least),
        bytes(memory)
    )))
}

/// What a thread takes to solve, and to write.
pub(super) const BUFFERS: Footprint = Footprint::of_thread(THREAD_BYTES);
pub(super) const WRITING: Footprint = Footprint::of_thread(COARSE_VOXELS * size_of::<f32>() as u64);

/// The box that the search begins with.
pub(super) fn begin(grid: &Geometry, cloud: &[[f64; 3]], settings: &ReconstructSettings) -> RegionOfInterest {
    RegionOfInterest::new(grid, cloud, first_reach_for(grid, settings.beta))
}

/// What that box holds; it may grow.
pub(super) fn boxes(region: &RegionOfInterest, cloud: &[[f64; 3]]) -> Footprint {
    Footprint::of_boxes(region.held(cloud))
}

/// The stages of a reconstruction that is thought to take so many seconds, and what each will probably take.
#[must_use]
pub fn plan(seconds: f64, writes: bool) -> Plan {
    let stages = [
        ("noise", 0.01),
        ("distance", 0.14),
        ("tagging", 0.2),
        ("band", 0.1),
        ("level set", 0.45),
        ("topology", 0.05),
        ("surface", 0.05),
    ];
    let written = [(viewer_mesh::STAGE, 0.05), ("write levelset", 0.02), ("write distance", 0.02)];
    let written = written.into_iter().filter(|_| writes);
    stages.into_iter().chain(written).map(|(name, share)| (name.into(), share * seconds)).collect()
}

/// Estimates a reconstruction on a grid with so many threads; `writes` says whether there is an output.
#[must_use]
pub fn estimate(
    grid: &Geometry,
    cloud: &[[f64; 3]],
    settings: &ReconstructSettings,
    threads: u64,
    writes: bool,
) -> Estimate {
    let region = begin(grid, cloud, settings);
    let near_voxels = (region.cells.len() * CELL_LEN) as u64;
    let working = if writes { BUFFERS.or(WRITING, threads) } else { BUFFERS };
    let sides = if settings.keeps_topology { 0 } else { topology_bytes(region.cells.len() as u64, cloud.len() as u64) };
    let working = working.and(Footprint::of_all(sides));
    Estimate {
        held: boxes(&region, cloud).and(working).bytes(threads),
        scratch: SIDES_BYTES * near_voxels,
        least_scratch: DISTANCE_BYTES * near_voxels,
        // Two fields of the whole box, their coarser levels an eighth each of the one before; far from the points they are
        // constant and take nothing.
        output: if writes { 8 * near_voxels.saturating_mul(8) / 7 } else { 0 },
        near_voxels,
        seconds: near_voxels as f64 * SECONDS_PER_NEAR_VOXEL / threads as f64,
    }
}
