//! What a distance will take: memory that must be held, temporary fields, time. The job reserves what is told here.

use super::costs::timed;
use super::{DistanceSettings, Kept, Schedule, Textbook, Wanted};
use crate::exec::{Footprint, Plan, ROUND_BYTES};
use crate::grid::{Box3, BrickGrid, DataSets, Geometry};
use crate::kernel::distance::features::exact_sources::work_bytes;
use crate::kernel::distance::repair::descent::remembered_bytes;
use crate::kernel::distance::seeding::outside::count_outside;
use crate::kernel::distance::state::precision::Precision;
use crate::kernel::geometry::rim::Rim;
use crate::kernel::geometry::triangle::Triangle;
use crate::kernel::geometry::winding_number::WindingTree;
use crate::store::VolumeSource;

/// An estimate; sizes in bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Needs {
    /// What must be in memory at the same time, bricks left out.
    pub footprint: Footprint,
    /// The same on all threads.
    pub held: u64,
    /// What of it is not taken before the field is solved.
    pub later: u64,
    /// Temporary fields.
    pub scratch: u64,
    /// Triangles that wait in a temporary file, where there is a surface and it goes into a mesh file. About.
    pub waiting: u64,
    /// Time, very roughly.
    pub seconds: f64,
}

impl Needs {
    /// The same where fields stay with who asked for them, the numbers of `sources` too where these are wanted.
    #[must_use]
    pub fn keeping<P: Precision>(self, geometry: &Geometry, sources: bool) -> Self {
        Self { scratch: self.scratch.saturating_add(Kept::<P>::bytes(geometry, sources)), ..self }
    }

    /// The same where speeds are read of an image before, on so many threads.
    #[must_use]
    pub fn reading(self, speeds: &dyn VolumeSource, threads: usize) -> Self {
        let natural = Box3::from_shape(speeds.natural_shape()).volume();
        let box_bytes = natural.saturating_mul((speeds.element().size() + size_of::<f32>()) as u64);
        let footprint = self.footprint.and(Footprint::of_thread(box_bytes.saturating_add(speeds.decoding_bytes())));
        Self { footprint, held: footprint.bytes(threads as u64), ..self }
    }

    /// The same for one of so many ranks of so many threads, each of which has its part of the fields and their tables, and of some bricks of
    /// others copies.
    fn of_rank(self, ranks: u64, threads: u64) -> Self {
        if ranks == 1 {
            return self;
        }
        // At the most half of what is read is others'.
        let scratch = 2 * self.scratch.div_ceil(ranks);
        let footprint = self.footprint.and(Footprint::of_all(MESSAGE_BYTES.min(2 * scratch)));
        let held = footprint.bytes(threads);
        Self { footprint, held, scratch, seconds: self.seconds / ranks as f64, ..self }
    }
}

/// What of a distance goes into a store.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Writes {
    /// Nothing.
    Nothing,
    /// What the settings ask for.
    Fields,
    /// The same, while other bricks are still solved.
    FieldsMeanwhile,
    /// That, and the borders of labels.
    FieldsAndBorders,
}

/// Bytes of messages that a rank holds at a time: bricks that it lends and borrows, and as much for what waits to be sent.
const MESSAGE_BYTES: u64 = 3 * ROUND_BYTES as u64;
/// Bytes of a voxel of a brick while sources are entered: the squared distance and source of those that fix it, and of
/// those it is told of.
const SEED_BYTES: u64 = 2 * (8 + 4);
/// Bytes of a voxel of one thread where sources are found along with distances or after them: tiles of sources, now and
/// before, and chains or what fell.
const TRACE_BYTES: u64 = 24;
/// Bytes kept of each brick: its lock, its state, its places in tables.
const BRICK_BYTES: u64 = 96;
/// Bytes kept of each source: its position, twice, its place in a brick's list, its corners.
const SOURCE_BYTES: u64 = 160;
/// Bytes of a triangle while it is told whether a mesh is closed: its three edges, and its share of the corners by place.
const CLOSED_BYTES: u64 = 3 * 12 + 32;
/// How often triangles are kept beside that: by the method, by who looks again, and for closest points.
const TRIANGLE_COPIES: u64 = 3;
/// Bytes of a point and of a triangle in their trees: a node is as large as what a parent keeps of itself, 72 bytes, or as
/// its triangle, and there are six to a parent.
const TREE_BYTES: [u64; 2] = [96, 240];
/// Voxels that a thread reads out at a time: a chunk.
const CHUNK: u64 = 64 * 64 * 64;
/// Bytes of a voxel that is read out with its source: source, label; the same with what is looked at again around it.
const READ_SOURCE_BYTES: u64 = 4 + 4 + 24;
/// Bytes of a voxel that is read with those around: border, source and label once more, in a box a voxel wider.
const READ_BORDER_BYTES: u64 = 4 + 10;
/// Bytes of a voxel whose side is told: whether it is fixed, known, inside; the flood's lists.
const READ_SIDE_BYTES: u64 = 3 + 2 * 24;
/// Seconds of one thread to read out a voxel, and more where it is written: its distance, its label, a coordinate.
const READ_SECONDS: f64 = 8e-9;
const WRITE_SECONDS: [f64; 3] = [25e-9, 8e-9, 20e-9];

/// How much longer times through an image of speeds take than distances: they are computed in f64, and ways bend.
const TIMED: f64 = 3.0;

/// Bytes of a voxel that was told exactly, and seconds of one thread for it.
const EXACT_BYTES: u64 = 8 + 4;
const EXACT_SECONDS: f64 = 300e-9;

/// Bytes that the trees of all sources take.
pub(crate) fn tree_bytes(sets: &DataSets) -> u64 {
    TREE_BYTES[0] * sets.positions.len() as u64 + TREE_BYTES[1] * sets.mesh.len() as u64
}

impl DistanceSettings {
    /// What these settings take on a grid, on so many threads of one of so many ranks.
    /// `writes` says what is stored.
    #[must_use]
    pub fn needs<P: Precision>(
        &self,
        geometry: &Geometry,
        sets: &DataSets,
        [threads, ranks]: [usize; 2],
        writes: Writes,
    ) -> Needs {
        let grid = BrickGrid::new(geometry.shape, self.brick);
        let (footprint, later) = self.footprint::<P>(geometry, sets, [threads, ranks], writes);
        let seconds = self.plan::<P>(geometry, threads, writes).iter().map(|(_, seconds)| seconds).sum();
        let held = footprint.bytes(threads as u64);
        let needs = Needs { footprint, held, later, scratch: self.scratch::<P>(&grid), waiting: 0, seconds };
        needs.of_rank(ranks as u64, threads as u64)
    }

    /// The stages of a distance, and what each will probably take.
    #[must_use]
    pub fn plan<P: Precision>(&self, geometry: &Geometry, threads: usize, writes: Writes) -> Plan {
        let all = geometry.domain().volume() as f64 / threads as f64;
        let solver = self.method.solver::<P>();
        // What is found apart from distances is found in a pass of its own; the textbook's order makes many.
        let apart = if self.keeps_sources() && !solver.tracks_sources() { 2.0 } else { 1.0 };
        let order = if self.schedule == Schedule::Front { 1.0 } else { 3.0 };
        let order = if self.timed { TIMED * order } else { order };
        let [distance, label, coordinate] = WRITE_SECONDS;
        let labels = f64::from(u32::from(self.labels) + u32::from(writes == Writes::FieldsAndBorders));
        let places = if self.closest_point { 3.0 } else { 0.0 };
        let written = distance + label * labels + coordinate * places;
        let written = if writes == Writes::Nothing { 0.0 } else { written };
        let looks_again = if self.keeps_sources() { 2.0 } else { 1.0 };
        let read = looks_again * READ_SECONDS + written;
        if self.exact {
            return vec![("read out".into(), all * (EXACT_SECONDS + read))];
        }
        vec![("distance".into(), all * solver.seconds * apart * order), ("read out".into(), all * read)]
    }

    /// Bytes of a store, if nothing of it could be compressed: the distance, what was asked for beside it, and where it is that
    /// of middle surfaces, all labels and their borders.
    #[must_use]
    pub fn written<P: Precision>(&self, geometry: &Geometry, is_middle: bool) -> u64 {
        let element = size_of::<P>() as u64;
        let labels = if is_middle { 5 } else { 4 * u64::from(self.labels) };
        let places = 3 * element * u64::from(self.closest_point);
        // Coarser levels are an eighth each of the one before.
        geometry.domain().volume().saturating_mul(element + labels + places).saturating_mul(8) / 7
    }

    /// What is in memory at one time beside bricks, and what of it is not before the read-out.
    fn footprint<P: Precision>(
        &self,
        geometry: &Geometry,
        sets: &DataSets,
        [threads, ranks]: [usize; 2],
        writes: Writes,
    ) -> (Footprint, u64) {
        let reading = self.reading::<P>(geometry, sets, threads, writes);
        if self.exact {
            let asking = work_bytes(sets.len() as u64) + EXACT_BYTES * CHUNK.min(geometry.domain().volume());
            return (self.tables::<P>(geometry, sets, ranks).and(reading).and(Footprint::of_thread(asking)), 0);
        }
        let solving = self.solving::<P>(geometry);
        let at_once =
            if writes == Writes::FieldsMeanwhile { solving.and(reading) } else { solving.or(reading, threads as u64) };
        let later = if writes == Writes::FieldsMeanwhile {
            0
        } else {
            at_once.bytes(threads as u64) - solving.bytes(threads as u64)
        };
        (self.tables::<P>(geometry, sets, ranks).and(at_once), later)
    }

    /// What is kept from the start to the end.
    fn tables<P: Precision>(&self, geometry: &Geometry, sets: &DataSets, ranks: usize) -> Footprint {
        let shares = ranks > 1 && self.heap_bytes::<P>(geometry) == 0;
        let bricks = bricks_of_rank(&BrickGrid::new(geometry.shape, self.brick), if shares { ranks as u64 } else { 1 });
        let triangles = sets.mesh.len() as u64;
        let copies = triangles * TRIANGLE_COPIES * size_of::<Triangle>() as u64;
        let inside = if self.signed {
            WindingTree::bytes(triangles) + Rim::bytes(triangles) + triangles * CLOSED_BYTES
        } else {
            0
        };
        let trees = if self.exact || self.looks_closer::<P>(sets) { tree_bytes(sets) } else { 0 };
        let outside = if count_outside(geometry, sets) > 0 { tree_bytes(sets) } else { 0 };
        let of_sources = sets.len() as u64 * SOURCE_BYTES + copies + inside + trees + outside;
        Footprint::of_all(bricks.saturating_mul(BRICK_BYTES).saturating_add(of_sources))
    }

    /// What entering sources and solving take: one after the other, in the same threads.
    fn solving<P: Precision>(&self, geometry: &Geometry) -> Footprint {
        let (edge, row) = (self.brick as usize, self.method.solver::<P>());
        let grown = (edge as u64 + 2).pow(3);
        let traced = if self.keeps_sources() && row.source_bytes > 0 { TRACE_BYTES * grown } else { 0 };
        let traced = traced + if self.timed { size_of::<f32>() as u64 * grown } else { 0 };
        // A state is no larger than a distance in f64.
        let tile = (row.cost)(edge, self.schedule).bytes::<u64>(edge);
        let tile = if self.timed { tile.max(timed(edge)) } else { tile };
        let seeding = SEED_BYTES * (edge as u64).pow(3);
        Footprint { held: self.heap_bytes::<P>(geometry), ..Footprint::of_thread(seeding.max(tile + traced)) }
    }

    /// What reading the solved field out and writing it take.
    fn reading<P: Precision>(&self, geometry: &Geometry, sets: &DataSets, threads: usize, writes: Writes) -> Footprint {
        let row = self.method.solver::<P>();
        let borders = writes == Writes::FieldsAndBorders;
        let looks_again = row.tracks_sources() && self.schedule == Schedule::Front;
        let mut voxel = 2 * size_of::<P>() as u64 + row.state_bytes;
        voxel += if self.keeps_sources() || looks_again { READ_SOURCE_BYTES } else { 0 };
        voxel += if borders { READ_BORDER_BYTES + size_of::<P>() as u64 } else { 0 };
        voxel += if self.signed { READ_SIDE_BYTES } else { 0 };
        let remembered = if self.looks_closer::<P>(sets) { remembered_bytes(sets.len()) } else { 0 };
        let reading = Footprint::of_thread(voxel * CHUNK.min(geometry.domain().volume()) + remembered);
        let wanted = Wanted { labels: self.labels, borders, closest_point: self.closest_point };
        match writes {
            Writes::Nothing => reading,
            _ => reading.and(Footprint::of_all(wanted.held::<P>(geometry, sets, threads))),
        }
    }

    /// Temporary fields.
    fn scratch<P: Precision>(&self, grid: &BrickGrid) -> u64 {
        let (brick, faces) = (grid.brick_len() as u64, 6 * (self.brick * self.brick) as u64);
        if self.exact {
            return 0;
        }
        let row = self.method.solver::<P>();
        let apart = if self.keeps_sources() { row.source_bytes } else { 0 };
        let element = row.state_bytes + apart;
        // Along with sweeps the faces of sources are kept a second time, as they were before.
        let swept = if matches!(self.schedule, Schedule::Sweep { .. }) { apart } else { 0 };
        let speeds = if self.timed { brick * size_of::<f32>() as u64 } else { 0 };
        grid.len().saturating_mul((brick + faces) * element + faces * swept + speeds)
    }

    /// What one heap over the whole volume takes, where these settings call for one.
    #[must_use]
    pub fn heap_bytes<P: Precision>(&self, geometry: &Geometry) -> u64 {
        match (self.schedule, self.method.solver::<P>().textbook) {
            (Schedule::Sweep { .. }, Textbook::Heap { bytes }) => {
                let bytes = bytes + if self.timed { size_of::<f32>() as u64 } else { 0 };
                geometry.domain().volume().saturating_mul(bytes)
            }
            _ => 0,
        }
    }
}

/// Bricks that a rank has and knows the faces of: its share of the grid's, and of those before and after these a layer and what is left
/// of another one.
fn bricks_of_rank(grid: &BrickGrid, ranks: u64) -> u64 {
    let [nx, ny, _] = grid.counts().map(i64::unsigned_abs);
    let beside = if ranks > 1 { 2 * (nx * ny + nx + 1) } else { 0 };
    grid.len().min(grid.len().div_ceil(ranks) + beside)
}
