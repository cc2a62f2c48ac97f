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

    /// Bytes of that room.
    #[must_use]
    pub fn bytes(geometry: &Geometry, sources: bool) -> u64 {
        let grid = BrickGrid::new(geometry.shape, EDGE);
        let voxel = size_of::<P>() + if sources { size_of::<u32>() } else { 0 };
        grid.len().saturating_mul((grid.brick_len() * voxel) as u64)
    }

    /// Takes what was read of a box.
    pub(super) fn put(&self, tile: &Tile<'_, P>) {
        self.values.write_box(tile.part, tile.values);
        self.sources.iter().for_each(|sources| sources.write_box(tile.part, tile.sources));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exec::{Budget, Cancel, Silent};
    use crate::store::Scratch;

    /// Against the files that it lies in, where there is no memory for it.
    #[test]
    fn what_is_kept_takes_what_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let scratch = Scratch::new(folder.path(), 0);
        let engine =
            Engine::new(1, scratch.clone(), Budget { total: 1 << 28 }, Cancel::default(), Arc::new(Silent)).unwrap();
        let geometry = Geometry { shape: [70, 64, 20], spacing: [1.0; 3], origin: [0.0; 3], unit: None };
        for (sources, bytes) in [(false, 2 * 64 * 64 * 64 * 8), (true, 2 * 64 * 64 * 64 * 12)] {
            assert_eq!(Kept::<f64>::bytes(&geometry, sources), bytes);
            let kept = Kept::<f64>::new(&engine, &geometry, sources).unwrap();
            assert_eq!(kept.values.set().owned().len() * 64 * 64 * 64 * 8, 2 * 64 * 64 * 64 * 8);
            assert_eq!(kept.sources.is_some(), sources);
        }
    }
}
