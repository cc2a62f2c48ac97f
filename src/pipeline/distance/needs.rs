//! What a distance will take: memory that must be held, temporary fields, time.

use super::{DistanceSettings, Schedule, Textbook, Wanted};
use crate::grid::{BrickGrid, DataSets, Geometry};
use crate::kernel::distance::repair::descent::remembered_bytes;
use crate::kernel::distance::seeding::outside::count_outside;
use crate::kernel::distance::state::precision::Precision;

/// An estimate; sizes in bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Needs {
    /// What must be in memory at the same time, bricks left out.
    pub held: u64,
    /// Temporary fields.
    pub scratch: u64,
    /// Time, very roughly.
    pub seconds: f64,
}

/// Bytes of a voxel of the tiles of one thread: the tile, its layout along diagonals (twice as long), coordinates.
const TILE_BYTES: u64 = 48;
/// Bytes of a voxel of one thread where sources are found beside distances: tiles of both, chains, or ghosts and what
/// fell.
const TRACE_BYTES: u64 = 24;
/// Bytes of a voxel while sources are entered: distance and source of those that fix it, and of those it is told of.
const SEED_BYTES: u64 = 24;
/// Bytes kept of each brick: its lock, its state, its places in tables.
const BRICK_BYTES: u64 = 96;
/// Bytes that every further rank keeps of each brick of the grid: its slot, its value where it is not stored.
const RANK_BYTES: u64 = 16;
/// Bytes kept of each source: its position, twice, its place in a brick's list, its corners.
const SOURCE_BYTES: u64 = 160;
/// Bytes of a point and of a triangle in their trees: a node is as large as what a parent keeps of itself, 72 bytes, or as
/// its triangle, and there are six to a parent.
const TREE_BYTES: [u64; 2] = [96, 240];
/// Seconds for a voxel on one thread.
const VOXEL_SECONDS: f64 = 30e-9;

/// Bytes that the trees of all sources take.
pub(crate) fn tree_bytes(sets: &DataSets) -> u64 {
    TREE_BYTES[0] * sets.positions.len() as u64 + TREE_BYTES[1] * sets.mesh.len() as u64
}

impl DistanceSettings {
    /// What these settings take on a grid, on so many threads that so many ranks share; each rank has one at least.
    #[must_use]
    pub fn needs<P: Precision>(&self, geometry: &Geometry, sets: &DataSets, threads: usize, ranks: usize) -> Needs {
        let grid = BrickGrid::new(geometry.shape, self.brick);
        let brick = grid.brick_len() as u64;
        let faces = 6 * (self.brick * self.brick) as u64;
        let row = self.method.solver::<P>();
        let apart = if self.keeps_sources() { row.source_bytes } else { 0 };
        let element = row.state_bytes + apart;
        let traced = if apart > 0 { TRACE_BYTES } else { 0 };
        let buffers = threads.max(ranks) as u64 * brick * (TILE_BYTES + SEED_BYTES + traced + element);
        let cuts = ranks.saturating_sub(1) as u64;
        let of_brick = BRICK_BYTES + cuts * RANK_BYTES;
        let held = buffers + grid.len().saturating_mul(of_brick) + sets.len() as u64 * SOURCE_BYTES;
        let remembered = threads as u64 * remembered_bytes(sets.len());
        let trees = if self.looks_closer::<P>(sets) { tree_bytes(sets) + remembered } else { 0 };
        let outside = if count_outside(geometry, sets) > 0 { tree_bytes(sets) } else { 0 };
        let held = held.saturating_add(self.heap_bytes::<P>(geometry)).saturating_add(trees + outside);
        // On either side of a cut lie ghosts, a plane of bricks at most, of which only faces are stored.
        let plane = grid.counts()[0].unsigned_abs().saturating_mul(grid.counts()[1].unsigned_abs());
        // Along with sweeps the faces of sources are kept a second time, as they were before.
        let swept = if matches!(self.schedule, Schedule::Sweep { .. }) { apart } else { 0 };
        let ghosts = plane.saturating_mul(2 * cuts).saturating_mul(faces * (element + swept));
        let scratch = grid.len().saturating_mul((brick + faces) * element + faces * swept).saturating_add(ghosts);
        let seconds = geometry.domain().volume() as f64 * VOXEL_SECONDS / threads as f64;
        Needs { held, scratch, seconds }
    }

    /// Bytes that are held while the images are written, beside what the distance takes; `borders` says whether those of
    /// labels are too.
    #[must_use]
    pub fn written_held<P: Precision>(
        &self,
        geometry: &Geometry,
        sets: &DataSets,
        borders: bool,
        threads: usize,
    ) -> u64 {
        let wanted = Wanted { labels: self.labels, borders, closest_point: self.closest_point };
        wanted.held::<P>(geometry, sets, threads)
    }

    /// What one heap over the whole volume takes, where these settings call for one.
    #[must_use]
    pub fn heap_bytes<P: Precision>(&self, geometry: &Geometry) -> u64 {
        match (self.schedule, self.method.solver::<P>().textbook) {
            (Schedule::Sweep { .. }, Textbook::Heap { bytes }) => geometry.domain().volume().saturating_mul(bytes),
            _ => 0,
        }
    }
}
