//! What joining objects takes: memory and scratch, told before it starts.

use super::EDGE;
use super::joined::FillGaps;
use super::widths::widest;
use crate::exec::Footprint;
use crate::grid::Geometry;
use crate::kernel::image::morphology::gaps::Gaps;
use crate::pipeline::output::drawn::STATED;

/// Bytes of scratch for a voxel: labels of contested voxels; with gaps also states, weights, costs, labels twice, faces.
const SETTLED_BYTES: u64 = 4;
const GAP_BYTES: u64 = 21;
/// Bytes for a voxel of the box around a brick in which gaps are looked for: labels, distances and passes of these, and
/// again for the part of it that tells what lies between two objects.
const BOX_BYTES: u64 = 36;

/// What is in memory at one time on so many threads, and bytes of scratch.
pub(in crate::pipeline::segment) fn needs(
    geometry: &Geometry,
    fill: Option<FillGaps>,
    threads: u64,
) -> (Footprint, u64) {
    let voxels = geometry.domain().volume();
    let faces = Footprint::of_all(STATED);
    let Some(fill) = fill else { return (faces, SETTLED_BYTES * voxels) };
    let width = match fill {
        FillGaps::Width(width) => width,
        FillGaps::Auto => widest(geometry),
    };
    let halo = Gaps::new(geometry.spacing, width, 0.0).halo();
    let around: u64 = halo.iter().map(|n| (EDGE + 2 * n).unsigned_abs()).product();
    let looking = Footprint::of_thread(around.saturating_mul(BOX_BYTES));
    (faces.or(looking, threads), (SETTLED_BYTES + GAP_BYTES) * voxels)
}
