//! A volume in another format: gathered in bricks by the boxes in which it is stored, each decoded once, and from there
//! written in the order and the boxes of the other format, in the type that it was stored in.

mod bricks;
mod file;
mod store;

use crate::error::Result;
use crate::exec::{Budget, Engine, Footprint};
use crate::grid::{Box3, Geometry};
use crate::io::ome_zarr::StoreWriter;
use crate::io::stack::write::formats::{VolumeFile, piece_bytes};
use crate::pipeline::output::pyramid::held;
use crate::store::{ElementType, VolumeSource};

pub use store::Kind;

/// A histogram of grey values.
const HISTOGRAM_BYTES: u64 = 8 << 20;
/// Pieces of a file that each thread packs before they are written.
const PIECES_PER_THREAD: usize = 4;

/// A volume that is to be written once more.
#[derive(Clone, Copy)]
pub struct Conversion<'a> {
    /// The volume.
    pub volume: &'a dyn VolumeSource,
    /// Where its voxels lie.
    pub geometry: &'a Geometry,
    /// The type in which they are written: one that holds all of them.
    pub stored: ElementType,
}

/// What a conversion takes.
#[derive(Clone, Copy, Debug)]
pub struct Needs {
    /// Bytes in memory at one time, bricks left out.
    pub footprint: Footprint,
    /// Bytes of bricks.
    pub scratch: u64,
    /// Bytes of the output, if nothing of it could be compressed.
    pub written: u64,
}

impl Conversion<'_> {
    /// What it takes on so many threads.
    #[must_use]
    pub fn needs(&self, threads: usize, is_store: bool) -> Needs {
        let (threads, element) = (threads as u64, self.volume.element());
        let natural = Box3::from_shape(self.volume.natural_shape()).volume();
        let reading = natural * element.size() as u64 + self.volume.decoding_bytes() + HISTOGRAM_BYTES;
        let voxels = self.geometry.domain().volume();
        let (writing, levels) = if is_store {
            (Footprint::of_all(held(self.geometry, &[self.stored], threads)), 8.0 / 7.0)
        } else {
            let piece = piece_bytes(self.geometry.shape, self.stored);
            (Footprint::of_thread(piece * PIECES_PER_THREAD as u64), 1.0)
        };
        Needs {
            footprint: Footprint::of_thread(reading).or(writing, threads),
            scratch: (voxels as f64 * element.size() as f64 * if is_store { levels } else { 1.0 }) as u64,
            written: (voxels as f64 * self.stored.size() as f64 * levels) as u64,
        }
    }

    /// The least memory that it can be done in.
    #[must_use]
    pub fn least(&self, threads: usize, is_store: bool) -> u64 {
        Budget::least(self.needs(threads, is_store).footprint.bytes(threads as u64))
    }

    /// Writes the volume as the image of a store.
    ///
    /// # Errors
    /// When the memory is too little, the volume cannot be read, the store cannot be written, scratch runs out or the run is
    /// interrupted.
    pub fn into_store(&self, engine: &Engine, store: &StoreWriter, kind: &Kind<'_>) -> Result<()> {
        let _held = engine.reserve(self.needs(engine.threads(), true).footprint)?;
        let gathered = bricks::gather(engine, self.volume)?;
        let window = matches!(kind, Kind::Image { .. }).then(|| gathered.window()).flatten();
        let image = kind.begin(store, self.geometry, self.stored, window)?;
        let stage = engine.stage("write image", 0);
        stage.voxels(self.geometry.domain().volume());
        gathered.bricks.with(self.stored, store::Writing { stage: &stage, engine, image, reduce: kind.reduce() })?;
        stage.finish();
        Ok(())
    }

    /// Writes the volume into a file; it gets its name with [`VolumeFile::finish`].
    ///
    /// # Errors
    /// As [`Conversion::into_store`].
    pub fn into_file(&self, engine: &Engine, file: &mut VolumeFile) -> Result<()> {
        let _held = engine.reserve(self.needs(engine.threads(), false).footprint)?;
        let gathered = bricks::gather(engine, self.volume)?;
        let stage = engine.stage("write file", file.pieces().count() as u64);
        stage.voxels(self.geometry.domain().volume());
        gathered.bricks.with(self.stored, file::Writing { stage: &stage, file })?;
        stage.finish();
        Ok(())
    }
}
