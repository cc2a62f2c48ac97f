//! A distance that stays with who asked for it: distances as they are read out, with their signs, and the numbers of the
//! nearest sources, in bricks that may lie in scratch.

use std::sync::Arc;

use super::tile::Tile;
use crate::error::Result;
use crate::exec::Engine;
use crate::grid::{BrickGrid, BrickSet, Geometry};
use crate::kernel::distance::state::precision::Precision;
use crate::store::BrickArray;

/// Edge of the bricks that it is kept in: as large as what is looked at at a time.
const EDGE: i64 = 64;

/// What is kept.
pub struct Kept<P: Precision> {
    /// Distances, negative inside of meshes where signs were asked for.
    pub values: BrickArray<P>,
    /// For each voxel the number of its nearest source, where labels or closest points were asked for.
    pub sources: Option<BrickArray<u32>>,
}

impl<P: Precision> Kept<P> {
    /// Room for a grid's distances, and for sources where these are wanted.
    ///
    /// # Errors
    /// When the scratch folder cannot hold it.
    pub fn new(engine: &Engine, geometry: &Geometry, sources: bool) -> Result<Self> {
        let set = Arc::new(BrickSet::dense(BrickGrid::new(geometry.shape, EDGE)));
        let values = BrickArray::new(engine.scratch(), &set)?;
        let sources = sources.then(|| BrickArray::new(engine.scratch(), &set)).transpose()?;
        Ok(Self { values, sources })
    }

    /// Takes what was read of a box.
    pub(super) fn put(&self, tile: &Tile<'_, P>) {
        self.values.write_box(tile.part, tile.values);
        self.sources.iter().for_each(|sources| sources.write_box(tile.part, tile.sources));
    }
}
