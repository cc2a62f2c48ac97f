//! The coarser levels of an image, made while it is read in: who looks on sees all of it before it is whole.

use std::sync::atomic::{AtomicU64, Ordering::AcqRel};
use std::sync::{Mutex, PoisonError};

use crate::error::Result;
use crate::exec::{Engine, Hold, Stage, Workers};
use crate::grid::{Box3, Geometry};
use crate::io::ome_zarr::ImageWriter;
use crate::pipeline::output::pyramid::{Pyramid, Reduce, visits};
use crate::store::{BoxSource, BrickArray, Element};

/// An image on its way into a store while it is read.
pub struct AsRead<T: Element> {
    pyramid: Pyramid<T>,
    /// Layers as thick as a chunk, and the voxels that are still to come of each.
    layers: Vec<(Box3, AtomicU64)>,
    /// Chunks of layers that are whole and were not taken yet.
    due: Mutex<Vec<Box3>>,
    buffers: Workers<(Vec<T>, Vec<T>)>,
    /// What it takes of the memory.
    _held: Hold,
}

impl<T: Element> AsRead<T> {
    /// An image of which nothing is read; `held` is what writing it takes.
    ///
    /// # Errors
    /// When scratch runs out.
    pub(crate) fn new(engine: &Engine, image: ImageWriter, geometry: &Geometry, held: Hold) -> Result<Self> {
        let pyramid = Pyramid::new(engine, image, Reduce::Mean)?;
        let [x, y, _] = geometry.shape;
        let layer = [x, y, pyramid.finest().chunk_shape()[2]];
        let layers = geometry.domain().tiles(layer).map(|part| (part, AtomicU64::new(part.volume()))).collect();
        Ok(Self { pyramid, layers, due: Mutex::default(), buffers: Workers::new(Default::default), _held: held })
    }

    /// A box was read into bricks; where a layer is whole with it, its chunks are due.
    pub(crate) fn read(&self, part: &Box3) {
        for (layer, missing) in &self.layers {
            let shared = part.intersect(layer);
            // What other threads have read is seen by the one that finds nothing missing.
            if !shared.is_empty() && missing.fetch_sub(shared.volume(), AcqRel) == shared.volume() {
                let chunks = layer.tiles(self.pyramid.finest().chunk_shape());
                self.due.lock().unwrap_or_else(PoisonError::into_inner).extend(chunks);
            }
        }
    }

    /// The chunks that have become due since this was last asked.
    pub(crate) fn take_due(&self) -> Vec<Box3> {
        std::mem::take(&mut *self.due.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// How many chunks there are.
    pub(crate) fn chunks(&self) -> u64 {
        self.layers.iter().map(|(layer, _)| layer.tiles(self.pyramid.finest().chunk_shape()).count() as u64).sum()
    }

    /// Puts a chunk that was due into the coarser levels.
    ///
    /// # Errors
    /// When a shard cannot be written.
    pub(crate) fn reduce(&self, chunk: &Box3, bricks: &BrickArray<T>) -> Result<()> {
        self.buffers.with(|(values, reduced)| {
            values.resize(chunk.len(), T::default());
            bricks.read_box(chunk, values)?;
            self.pyramid.put_coarser(chunk, values, reduced)
        })
    }

    /// Writes the finest level, when all is read.
    ///
    /// # Errors
    /// When a shard cannot be written or the run is interrupted.
    pub(crate) fn finish(&self, stage: &Stage<'_>, engine: &Engine, bricks: &BrickArray<T>) -> Result<()> {
        let visits = visits([self.pyramid.finest()], engine.threads());
        stage.expect(visits.len() as u64);
        stage.run(&visits, &self.buffers, |(values, _), visit| {
            visit.iter().try_for_each(|chunk| {
                values.resize(chunk.len(), T::default());
                bricks.read_box(chunk, values)?;
                self.pyramid.put_finest(chunk, values)
            })
        })?;
        Ok(())
    }
}
